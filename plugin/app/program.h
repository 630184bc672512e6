// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <exception>
#include <stdexcept>
#include <string>

namespace efm {

/// The exit statuses of the program: 0, and these. Its help lists them.
inline constexpr int kFailedStatus = 1;         ///< The job could not be done; --strict.
inline constexpr int kUsageStatus = 2;          ///< The command line or an option file is wrong.
inline constexpr int kInterruptedStatus = 130;  ///< Stopped as requested: a shell's for SIGINT.

/// The command line or an option file is wrong.
class UsageError : public std::invalid_argument {
 public:
  using std::invalid_argument::invalid_argument;
};

/// Runs a step whose std::invalid_argument is the fault of the command line: a UsageError then.
template <typename Step>
auto asUsage(const Step& step) {
  try {
    return step();
  } catch (const std::invalid_argument& error) {
    throw UsageError(error.what());
  }
}

/// Prints an error to stderr, "event-fusion: error: …". @return the status.
int fail(const std::string& message, int status = kFailedStatus);

/// An exception in words for the user: one sentence, without what a library adds for its
/// programmers (call stacks, places in its sources, names of types).
std::string inWords(const std::exception& error);

/// The program `event-fusion`: runs the command of the command line. Prints every error to stderr.
/// @return the process's exit status, one of those above: 0 only if the command has done its job
/// and stdout took its output.
int runProgram(int argc, char** argv);

}  // namespace efm
