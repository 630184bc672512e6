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
#include "plugin/checks/health_checks.h"
#include "plugin/recordings/open/open_recording.h"

namespace efm {

/// Prints a line per warning to stderr: "event-fusion: warning: NAME: text".
/// @param kind "note" in place of "warning".
void printWarnings(const std::vector<Warning>& warnings, const char* kind = "warning");

/// Prints an error if there are warnings, for --strict. @return true if there are warnings.
bool failStrictly(const std::vector<Warning>& warnings);

/// Time on the command line: on the recording's clock or, as "+3.2", from its first event on.
struct TimeArgument {
  std::int64_t ns = 0;
  bool from_start = false;
};

/// Interval of a recording on the command line.
struct TimeArguments {
  std::optional<TimeArgument> t0;
  std::optional<TimeArgument> t1;
  std::optional<std::int64_t> duration_ns;  ///< Duration from t0, or from the first event.
};

/// Converts times of the command line to the recording's clock. Opens the recording at most once,
/// and only if a time counts from its first event (of a session: from its first keyframe).
class RecordingTimes {
 public:
  explicit RecordingTimes(RecordingSource source) : source_(std::move(source)) {}

  /// @throws std::runtime_error if the recording has no event; the errors of `openRecording`.
  std::int64_t resolve(const TimeArgument& time);
  TimeLimits resolve(const TimeArguments& times);

 private:
  std::int64_t start();

  RecordingSource source_;
  std::optional<std::int64_t> start_ns_;  // time of the first event, once it is known
};

/// Reads a recording to its end, or to its damage.
/// @param take receives each sample; its exceptions end the reading.
/// @return the error of the recording; std::nullopt if the recording was read to its end.
std::optional<std::string> readAll(Recording& recording, const std::function<void(Sample)>& take);

/// Reports the damage that ended a recording, after the data before it were written.
/// @return the process's exit status.
int failAfter(const std::string& damage, std::uint64_t events, std::uint64_t poses,
              const std::filesystem::path& out);

}  // namespace efm
