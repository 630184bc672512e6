// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <CLI/App.hpp>
#include <functional>

namespace efm {

/// Adds every command to the program, with its options and its help; the one that is chosen on the
/// command line sets `run`, which gives the process's exit status.
void addCommands(CLI::App& app, std::function<int()>& run);

}  // namespace efm
