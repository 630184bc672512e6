// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <exception>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "mapping/base/option.h"
#include "plugin/checks/health_checks.h"
#include "plugin/checks/recording_statistics.h"
#include "plugin/recordings/open/open_recording.h"

namespace efm {

/// What `event-fusion info` says of a recording.
struct RecordingInfo {
  std::uint64_t observations = 0;
  RecordingStatistics statistics;
  std::map<std::string, std::uint64_t> others;  ///< Numbers of other samples, by class.
  RecordingCounts counts;
  std::size_t true_depth_maps = 0;
  std::vector<ChosenOption> chosen;  ///< The values that `map` would choose by default.
  std::vector<Warning> warnings;
  std::vector<Warning> notes;  ///< What could not be checked.
  /// Why the recording was not read to its end, or has no events within its limits. There are
  /// neither chosen values nor warnings then. Empty without error.
  std::string error;
};

/// Reads a recording to its end, or to its damage. Parts of it may be missing.
/// @param progress receives the fraction that is read, 0 to 1; its exceptions end the reading.
/// @throws std::exception if the recording cannot be opened.
RecordingInfo readInfo(RecordingSource source, const std::function<void(double)>& progress);

/// Returns the info as JSON: observations, cameras, poses (by source), events_before_poses,
/// events_after_poses, topics and transforms (of bags), others, sorted_events, true_depth_maps,
/// chosen, warnings and notes.
std::string infoJson(const RecordingInfo& info);

/// Returns the error of time limits without events: they may be mistyped. Empty without limits, and
/// for a recording without cameras. @param recording was read, and had no event.
std::string limitsWithoutEvents(const TimeLimits& limits, const Recording& recording);
/// Throws that error, if there is one.
void rejectLimitsWithoutEvents(const TimeLimits& limits, const Recording& recording);

}  // namespace efm
