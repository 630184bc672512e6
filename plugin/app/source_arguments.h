// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <CLI/App.hpp>
#include <cstdint>
#include <optional>
#include <string>

#include "plugin/app/recording_interval.h"
#include "plugin/recordings/open/open_recording.h"
#include "tracking_stub/faults/tracker_faults.h"

namespace efm {

/// Adds SOURCE and the options that replace or perturb a part of the recording.
void addSource(CLI::App& command, RecordingSource& source);

/// Adds --t0, --t1 and --duration. @return --t0.
CLI::Option* addTimeLimits(CLI::App& command, TimeArguments& times);

/// Adds an option whose value is a time of the recording.
CLI::Option* addTime(CLI::App& command, const std::string& name, std::optional<TimeArgument>& time,
                     const std::string& help);

/// Adds --strict.
void addStrict(CLI::App& command, bool& strict);

/// A number of seconds, exact to the nanosecond.
/// @param name of the option, for errors.
/// @throws CLI::ValidationError naming the option and its value.
std::int64_t nanosecondsOf(const std::string& text, const std::string& name);

/// For a command without an option file, which has the length of a keyframe.
/// @throws CLI::ValidationError as `requireKeyframeLength` does.
void requireKeyframeLengthOf(const TrackerFaults& faults);

}  // namespace efm
