// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/app/import_command.h"

#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <iostream>
#include <map>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>

#include "mapping/geometry/timestamp.h"
#include "plugin/app/progress.h"
#include "plugin/formats/open_recording.h"
#include "plugin/formats/rawlog_writer.h"
#include "plugin/mrpt/CObservationEvents.h"
#include "plugin/mrpt/pose_observation.h"
#include "plugin/recordings/time_cut.h"

namespace efm {

namespace {

/// The stretch that was asked for, as an error repeats it.
std::string askedFor(const ImportArguments& arguments) {
  std::string text;
  if (arguments.t0_ns) text += "from --t0 " + formatSeconds(*arguments.t0_ns) + " s";
  if (arguments.t0_ns && arguments.t1_ns) text += " ";
  if (arguments.t1_ns) text += "until --t1 " + formatSeconds(*arguments.t1_ns) + " s";
  return text;
}

/// Times of the first and the last event of the whole recording.
std::optional<std::pair<std::int64_t, std::int64_t>> eventSpan(const ImportArguments& arguments) {
  const std::unique_ptr<Recording> recording = openRecording(arguments.source);
  std::optional<std::pair<std::int64_t, std::int64_t>> span_ns;
  while (const auto observation = recording->next()) {
    const auto packet = std::dynamic_pointer_cast<CObservationEvents>(observation);
    if (!packet || packet->events.empty()) continue;
    const std::int64_t first_ns = packet->events.front().t_ns;
    const std::int64_t last_ns = packet->events.back().t_ns;
    if (!span_ns) span_ns.emplace(first_ns, last_ns);
    span_ns = {std::min(span_ns->first, first_ns), std::max(span_ns->second, last_ns)};
  }
  return span_ns;
}

/// A mistyped limit must not give a rawlog without the events that are there.
/// @throws std::runtime_error that says where the events are.
void refuseStretchWithoutEvents(const ImportArguments& arguments) {
  if (!arguments.t0_ns && !arguments.t1_ns) return;
  const auto span_ns = eventSpan(arguments);
  if (!span_ns) return;  // it never had any, but may hold other things
  throw std::runtime_error("no event " + askedFor(arguments) + ": the recording has events from " +
                           formatSeconds(span_ns->first) + " s to " +
                           formatSeconds(span_ns->second) + " s");
}

}  // namespace

int runImport(const ImportArguments& arguments) {
  const std::unique_ptr<Recording> recording =
      cutTime(openRecording(arguments.source), arguments.t0_ns, arguments.t1_ns);
  RawlogWriter writer(arguments.out);
  std::map<std::string, std::uint64_t> events;  // per label
  std::uint64_t all_events = 0;
  std::uint64_t poses = 0;
  std::uint64_t odometry = 0;  // of them
  std::uint64_t others = 0;
  {
    Progress progress;
    while (const auto observation = recording->next()) {
      writer.write(*observation);
      if (const auto packet = std::dynamic_pointer_cast<CObservationEvents>(observation)) {
        events[packet->sensorLabel] += packet->events.size();
        all_events += packet->events.size();
      } else if (const auto source = poseSourceOf(*observation)) {
        ++poses;
        if (source->kind == PoseKind::kOdometry) ++odometry;
      } else {
        ++others;
      }
      progress.showShare("importing", recording->progress());
    }
    if (all_events == 0) refuseStretchWithoutEvents(arguments);
    if (all_events + poses + others == 0) {
      throw std::runtime_error("the recording holds nothing " + askedFor(arguments));
    }
    writer.close();
  }
  for (const auto& [label, count] : events) {
    std::printf("%s: %llu events\n", label.c_str(), static_cast<unsigned long long>(count));
  }
  if (others > 0) {
    std::printf("%llu other observations\n", static_cast<unsigned long long>(others));
  }
  std::printf("%llu poses; %llu events were out of order and sorted\n",
              static_cast<unsigned long long>(poses),
              static_cast<unsigned long long>(recording->counts().sorted_events));
  if (odometry > 0 && !arguments.source.hand_eye.empty()) {
    std::cerr << "event-fusion: warning: odometry (" << odometry
              << " observations) cannot hold the hand-eye transform: give it to map as well\n";
  }
  const auto bytes = static_cast<double>(std::filesystem::file_size(arguments.out));
  std::printf("written to %s, %.1f MB, %.2f bytes per event\n", arguments.out.c_str(), bytes * 1e-6,
              all_events == 0 ? 0.0 : bytes / static_cast<double>(all_events));
  return 0;
}

}  // namespace efm
