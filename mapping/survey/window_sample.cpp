// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/survey/window_sample.h"

#include <algorithm>
#include <utility>

#include "mapping/events/even_choice.h"
#include "mapping/geometry/timestamp.h"

namespace efm {

WindowSample sampleOf(const WindowData& data) {
  WindowSample sample;
  sample.window = data.window;
  for (const EventSpan& events : data.events) {
    sample.events.push_back(chosenEvenly(events, kMaxSampleEvents));
  }
  constexpr std::int64_t kMarginNs = kNanosecondsPerSecond / 2;
  sample.trajectory =
      data.trajectory->moved(data.window.t0_ns - kMarginNs, data.window.t1_ns + kMarginNs,
                             [](const StampedPose& pose) { return pose.T_world_rig; });
  return sample;
}

std::vector<EventSpan> eventsWithin(const WindowSample& sample, const Window& window) {
  const auto earlier = [](const Event& event, std::int64_t t_ns) { return event.t_ns < t_ns; };
  std::vector<EventSpan> spans;
  for (const std::vector<Event>& events : sample.events) {
    const auto begin = std::lower_bound(events.begin(), events.end(), window.t0_ns, earlier);
    const auto end = std::lower_bound(begin, events.end(), window.t1_ns, earlier);
    spans.push_back(EventSpan(events).part(static_cast<std::size_t>(begin - events.begin()),
                                           static_cast<std::size_t>(end - events.begin())));
  }
  return spans;
}

WindowData middleOf(const WindowSample& sample, double duration_s) {
  const Window& whole = sample.window;
  const std::int64_t length_ns =
      std::min(durationFromSeconds(duration_s), whole.t1_ns - whole.t0_ns);
  const std::int64_t t0_ns = whole.t0_ns + (whole.t1_ns - whole.t0_ns - length_ns) / 2;
  WindowData middle;
  middle.window = {t0_ns, t0_ns + length_ns, t0_ns + length_ns / 2};
  middle.trajectory = &sample.trajectory;
  middle.events = eventsWithin(sample, middle.window);
  return middle;
}

void SpreadSamples::add(const WindowData& data) {
  if (windows_++ % step_ != 0) return;
  samples_.push_back(sampleOf(data));
  if (samples_.size() <= kMaxSamples) return;
  std::vector<WindowSample> kept;
  for (std::size_t i = 0; i < samples_.size(); i += 2) kept.push_back(std::move(samples_[i]));
  samples_ = std::move(kept);
  step_ *= 2;
}

}  // namespace efm
