// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <CLI/App.hpp>
#include <CLI/Validators.hpp>

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "plugin/app/commands.h"
#include "plugin/app/recording_interval.h"
#include "plugin/playback/progress.h"
#include "plugin/recordings/open/open_recording.h"
#include "tracking_stub/faults/tracker_faults.h"

namespace efm {

/// Function that runs a command and returns the exit status.
using Run = std::function<int()>;

/// Makes the arguments of a command. They live as long as the command. If the user chooses the
/// command, `run` becomes a call of `handler` with these arguments.
template <typename Arguments>
std::shared_ptr<Arguments> argumentsOf(CLI::App& command, Run& run,
                                       int (*handler)(const Arguments&)) {
  auto arguments = std::make_shared<Arguments>();
  command.callback([arguments, handler, &run] { run = [=] { return handler(*arguments); }; });
  return arguments;
}

/// Adds --quiet and, for a command with keyframes, --verbose.
void addVerbosity(CLI::App& command, Verbosity& verbosity, bool has_keyframes = false);

/// Checks of an option's value. Their errors show the value and the expected values.

CLI::Validator oneOf(const std::vector<std::string>& names);
CLI::Validator aboveZero();
CLI::Validator zeroOrMore();
/// @param range the range in words: "0 to 1 (a share of the pixels)".
CLI::Validator between(double low, double high, const std::string& range);

/// Returns the error of a wrong command line: one sentence with the words that the user typed.
/// @param app has parsed the command line.
std::string errorText(const CLI::App& app, const CLI::ParseError& error);

/// Adds SOURCE and the options that replace or perturb parts of the recording.
void addSource(CLI::App& command, RecordingSource& source);

/// Adds --t0, --t1 and --duration. @return --t0.
CLI::Option* addTimeLimits(CLI::App& command, TimeArguments& times);

/// Adds an option whose value is a unit of time.
void addTimeUnit(CLI::App& command, const std::string& name, std::string& unit,
                 const std::string& help);

/// Adds an option whose value is a time of the recording.
CLI::Option* addTime(CLI::App& command, const std::string& name, std::optional<TimeArgument>& time,
                     const std::string& help);

/// Adds --strict.
void addStrict(CLI::App& command, bool& strict);

/// Returns a number of seconds as nanoseconds, exactly.
/// @param name of the option, for errors.
/// @throws CLI::ValidationError with the option and its value.
std::int64_t nanosecondsOf(const std::string& text, const std::string& name);

/// For commands without an option file, which would give the length of a keyframe.
/// @throws CLI::ValidationError if there is noise per keyframe, but no length of a keyframe.
void requireKeyframeLength(const TrackerFaults& faults);

void addMap(CLI::App& app, Run& run);
/// Adds `plan` and `join`.
void addShards(CLI::App& app, Run& run);
void addDepth(CLI::App& app, Run& run);

/// Adds `evaluate` and its kinds: depth, map, trajectory.
void addEvaluate(CLI::App& app, Run& run);

void addSimulate(CLI::App& app, Run& run);

}  // namespace efm
