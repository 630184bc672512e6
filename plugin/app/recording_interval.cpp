// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/app/recording_interval.h"

#include <fmt/format.h>

#include <iostream>
#include <stdexcept>
#include <utility>

#include "plugin/mrpt/CObservationEvents.h"
#include "plugin/recordings/time_cut.h"

namespace efm {

std::int64_t startOf(const RecordingSource& source) {
  RecordingSource events = source;
  events.complete = false;
  const std::unique_ptr<Recording> recording = openRecording(events);
  while (const auto observation = recording->next()) {
    const auto* packet = dynamic_cast<const CObservationEvents*>(observation.get());
    if (packet != nullptr && !packet->events.empty()) return packet->events.front().t_ns;
  }
  throw std::runtime_error("a time from the recording's start: it has no events");
}

std::int64_t resolve(const TimeArgument& time, const RecordingSource& source) {
  return time.from_start ? startOf(source) + time.ns : time.ns;
}

TimeLimits resolve(const TimeArguments& times, const RecordingSource& source) {
  TimeLimits limits;
  if (times.t0) limits.t0_ns = resolve(*times.t0, source);
  if (times.t1) limits.t1_ns = resolve(*times.t1, source);
  if (times.duration_ns) {
    limits.t1_ns = (limits.t0_ns ? *limits.t0_ns : startOf(source)) + *times.duration_ns;
  }
  return limits;
}

std::unique_ptr<Recording> openInterval(RecordingSource source, const TimeLimits& limits) {
  source.start_ns = limits.t0_ns;
  source.end_ns = limits.t1_ns;
  return cutTime(openRecording(source), limits.t0_ns, limits.t1_ns);
}

std::optional<std::string> lostPacketsWarning(const RecordingCounts& counts) {
  if (counts.lost_packets == 0) return std::nullopt;
  return fmt::format("the recording lacks {} packets of events: their numbers have gaps",
                     counts.lost_packets);
}

void warnOfLostPackets(const RecordingCounts& counts) {
  if (const auto text = lostPacketsWarning(counts)) {
    std::cerr << "event-fusion: warning: " << *text << "\n";
  }
}

}  // namespace efm
