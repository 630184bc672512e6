// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>

namespace efm {

/// Parses the command line. Prints the help or the version.
/// @return runs the chosen command, if there is one, and returns the process's exit status.
/// @throws UsageError if the command line is wrong.
std::function<int()> parseCommandLine(int argc, char** argv);

}  // namespace efm
