// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/app/recording_survey.h"

#include <algorithm>
#include <exception>

#include "mapping/events/even_choice.h"
#include "mapping/geometry/timestamp.h"
#include "plugin/app/interruption.h"
#include "plugin/app/progress.h"
#include "plugin/mrpt/session_feed.h"

namespace efm {
namespace {

/// Poses reach this far around the middle of a sample: see `window_sample.h`.
constexpr double kWindowS = 2;
constexpr double kMaxEventsPerSecond = 1e6;

void thinOut(CameraPacket& packet) {
  if (packet.events.size() < 2) return;
  const double length_s = secondsBetween(packet.events.front().t_ns, packet.events.back().t_ns);
  const auto limit = static_cast<std::size_t>(std::max(1e3, kMaxEventsPerSecond * length_s));
  std::vector<Event> chosen;
  chooseEvenly(packet.events, limit, chosen);
  if (!chosen.empty()) packet.events = std::move(chosen);
}

}  // namespace

RecordingSurvey surveyRecording(const MappingJob& job, Recording& recording) {
  EventFusionOptions survey = job.options;
  survey.automatic = {};
  survey.refinement.enabled = false;
  survey.mapper = surveyOptions(job.options.mapper, kWindowS);
  MappingSession session(survey);
  SpreadSamples samples;
  const auto take = [&] {
    while (const std::optional<WindowData> data = session.window()) {
      samples.add(*data);
      session.skipWindow(data->window);
    }
  };
  Progress progress("first look", job.verbosity);
  try {
    while (const auto observation = recording.next()) {
      if (job.stop_requested && job.stop_requested()) throw Interrupted();
      if (const auto* events = dynamic_cast<const CObservationEvents*>(observation.get())) {
        CameraPacket packet = packetOf(*events);
        thinOut(packet);
        session.addEvents(std::move(packet));
      } else if (!addPoseOf(*observation, session)) {
        continue;
      }
      take();
      progress.show(recording.progress());
    }
    session.finish();
    if (samples.samples().empty()) {
      if (const std::optional<WindowData> rest = session.window()) samples.add(*rest);
    }
  } catch (const Interrupted&) {
    throw;
  } catch (const std::exception&) {
  }
  const SessionStatus status = session.status();
  RecordingSurvey result{status.rig, samples.samples(), std::nullopt};
  if (status.events && status.poses) {
    result.duration_s = secondsBetween(std::max(status.events->first_ns, status.poses->first_ns),
                                       std::min(status.events->last_ns, status.poses->last_ns));
  }
  return result;
}

}  // namespace efm
