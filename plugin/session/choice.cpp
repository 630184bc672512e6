// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/session/choice.h"

#include <algorithm>
#include <cstddef>

#include "mapping/geometry/timestamp.h"

namespace efm {

Chosen choose(const RecordingSurvey& survey, const EventFusionOptions& options) {
  Chosen chosen{options.mapper, {}, {}};
  if (options.automatic.any()) {
    chosen.choice = chooseOptions(options.automatic, survey.rig, survey.samples, survey.duration_s,
                                  chosen.mapper);
    const double passed =
        options.live.max_event_rate * static_cast<double>(survey.rig.cameras.size());
    const double most = survey.most_events_per_s;
    fitIntoQueue(options.live, passed > 0 ? std::min(passed, most) : most, chosen.mapper.policy,
                 chosen.choice.options);
  }
  return chosen;
}

double eventRate(const WindowData& data) {
  std::size_t events = 0;
  for (const EventSpan& span : data.events) events += span.size();
  return static_cast<double>(events) / secondsBetween(data.window.t0_ns, data.window.t1_ns);
}

}  // namespace efm
