// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <CLI/App.hpp>
#include <functional>
#include <memory>

namespace efm {

/// What the command that was chosen does; gives the process's exit status.
using Run = std::function<int()>;

/// A command whose arguments live as long as the program's description; when it is chosen on the
/// command line, `run` becomes the handler's call with them.
template <typename Arguments>
std::shared_ptr<Arguments> onCommand(CLI::App& command, Run& run,
                                     int (*handler)(const Arguments&)) {
  auto arguments = std::make_shared<Arguments>();
  command.callback([arguments, handler, &run] { run = [=] { return handler(*arguments); }; });
  return arguments;
}

}  // namespace efm
