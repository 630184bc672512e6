// SPDX-License-Identifier: BSD-3-Clause
#pragma once

namespace efm {

/// The program `event-fusion`: runs the command of the command line. Prints every error to stderr.
/// @return the process's exit status, see exit_status.h: 0 only if the command has done its job and
/// stdout took its output.
int runProgram(int argc, char** argv);

}  // namespace efm
