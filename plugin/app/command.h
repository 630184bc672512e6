// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <CLI/App.hpp>
#include <functional>
#include <memory>

#include "plugin/app/progress.h"

namespace efm {

/// Runs a command and returns the process's exit status.
using Run = std::function<int()>;

/// Makes the arguments of a command. They live as long as the command. If the user chooses the
/// command, `run` becomes a call of `handler` with them.
template <typename Arguments>
std::shared_ptr<Arguments> argumentsOf(CLI::App& command, Run& run,
                                       int (*handler)(const Arguments&)) {
  auto arguments = std::make_shared<Arguments>();
  command.callback([arguments, handler, &run] { run = [=] { return handler(*arguments); }; });
  return arguments;
}

/// Adds --quiet and, for a command with keyframes, --verbose.
void addVerbosity(CLI::App& command, Verbosity& verbosity, bool has_keyframes = false);

}  // namespace efm
