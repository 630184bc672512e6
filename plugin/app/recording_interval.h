// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "mapping/events/window.h"
#include "plugin/recordings/open/open_recording.h"
#include "plugin/session/health_checks.h"

namespace efm {

/// Prints a line per warning to stderr: "event-fusion: warning: NAME: text".
void printWarnings(const std::vector<Warning>& warnings);

/// For --strict: prints an error if there are warnings. @return whether there are.
bool failStrictly(const std::vector<Warning>& warnings);

/// A time on the command line: on the recording's clock, or ("+3.2") from its first event on.
struct TimeArgument {
  std::int64_t ns = 0;
  bool from_start = false;
};

/// An interval of a recording on the command line.
struct TimeArguments {
  std::optional<TimeArgument> t0;
  std::optional<TimeArgument> t1;
  std::optional<std::int64_t> duration_ns;  ///< From t0, or from the first event.
};

/// The times of the command line on the recording's clock. The recording is opened at most once,
/// and only if a time counts from its first event.
class RecordingTimes {
 public:
  explicit RecordingTimes(RecordingSource source) : source_(std::move(source)) {}

  /// @throws std::runtime_error if the recording has no event; the errors of `openRecording`.
  std::int64_t resolve(const TimeArgument& time);
  TimeLimits resolve(const TimeArguments& times);

 private:
  std::int64_t start();

  RecordingSource source_;
  std::optional<std::int64_t> start_ns_;  // of the first event, once it is known
};

/// Reads a recording to its end, or to its damage.
/// @param take receives each sample; what it throws ends the reading.
/// @return the error of the recording, if it was not read to its end.
std::optional<std::string> readAll(Recording& recording, const std::function<void(Sample)>& take);

/// Why an interval of a recording has no events: the times of the nearest ones that were read.
std::string noEventText(const TimeLimits& limits, const RecordingCounts& counts);

/// Rejects time limits without events: they may be mistyped. A recording without cameras passes.
/// @param recording which was read, and had no event.
void refuseLimitsWithoutEvents(const TimeLimits& limits, const Recording& recording);

/// Reports the damage that ended a recording, after all before it was written.
/// @return the process's exit status.
int failAfter(const std::string& damage, std::uint64_t events, std::uint64_t poses,
              const std::filesystem::path& out);

}  // namespace efm
