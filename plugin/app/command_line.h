// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>

namespace efm {

/// Parses the command line. Prints the help, the version, or the error of a wrong command line.
/// @return runs the chosen command, if there is one, and returns the process's exit status.
std::function<int()> parseCommandLine(int argc, char** argv);

}  // namespace efm
