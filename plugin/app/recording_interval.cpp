// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/app/recording_interval.h"

#include <fmt/format.h>

#include <iostream>
#include <stdexcept>

#include "mapping/geometry/timestamp.h"
#include "plugin/app/program.h"
#include "plugin/playback/session_map.h"
#include "plugin/session/session_status.h"
#include "plugin/session_file/session_file.h"

namespace efm {

void printWarnings(const std::vector<Warning>& warnings, const char* kind) {
  for (const Warning& warning : warnings) {
    std::cerr << "event-fusion: " << kind << ": " << warning.name << ": " << warning.text << "\n";
  }
}

bool failStrictly(const std::vector<Warning>& warnings) {
  if (warnings.empty()) return false;
  fail(fmt::format("{} warnings, and --strict makes them errors", warnings.size()));
  return true;
}

std::int64_t RecordingTimes::start() {
  if (start_ns_) return *start_ns_;
  if (const auto session = sessionAt(source_.files.front())) {
    start_ns_ = SessionFile(*session).keyframe(0).window.t_ref_ns;
    return *start_ns_;
  }
  RecordingSource events;  // their times need neither poses nor transforms
  events.files = source_.files;
  events.format = source_.format;
  events.calibration = source_.calibration;
  events.setup = source_.setup;
  events.cameras = source_.cameras;
  events.reader = source_.reader;
  events.skip_bad_events = source_.skip_bad_events;
  events.complete = false;
  const std::unique_ptr<Recording> recording = openRecording(events);
  while (const std::optional<Sample> sample = recording->next()) {
    const auto* packet = std::get_if<EventPacket>(&*sample);
    if (packet == nullptr || packet->events.empty()) continue;
    start_ns_ = packet->events.front().t_ns;
    return *start_ns_;
  }
  throw std::runtime_error("a time from the recording's start: it has no events");
}

std::int64_t RecordingTimes::resolve(const TimeArgument& time) {
  return time.from_start ? start() + time.ns : time.ns;
}

TimeLimits RecordingTimes::resolve(const TimeArguments& times) {
  TimeLimits limits;
  if (times.t0) limits.t0_ns = resolve(*times.t0);
  if (times.t1) limits.t1_ns = resolve(*times.t1);
  if (times.duration_ns) {
    limits.t1_ns = (limits.t0_ns ? *limits.t0_ns : start()) + *times.duration_ns;
  }
  return limits;
}

std::optional<std::string> readAll(Recording& recording, const std::function<void(Sample)>& take) {
  while (std::optional<Sample> sample = recording.read()) take(std::move(*sample));
  if (const std::string damage = recording.damage(); !damage.empty()) {
    return userMessage(std::runtime_error(damage));
  }
  return std::nullopt;
}

int failAfter(const std::string& damage, std::uint64_t events, std::uint64_t poses,
              const std::filesystem::path& out) {
  return fail(fmt::format("{}; {} events and {} poses before it are written to {}", damage, events,
                          poses, out.string()));
}

}  // namespace efm
