// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <stdexcept>
#include <string>

#include "plugin/playback/error_text.h"

namespace efm {

/// Exit statuses of the program, beside 0. Its help lists them.
inline constexpr int kFailedStatus = 1;  ///< The job could not be done, or warnings with --strict.
inline constexpr int kUsageStatus = 2;   ///< The command line or an option file is wrong.
/// Of shards and their join: no memory, no room on the disk, another process at work, or a signal.
inline constexpr int kTryAgainStatus = 75;      // EX_TEMPFAIL of sysexits.h
inline constexpr int kInterruptedStatus = 130;  ///< Stopped as requested; as shells for SIGINT.

/// The command line or an option file is wrong.
class UsageError : public std::invalid_argument {
 public:
  using std::invalid_argument::invalid_argument;
};

/// Runs a step. If it throws std::invalid_argument, the command line is wrong: a UsageError.
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

/// Runs the program `event-fusion` with a command line. Prints every error to stderr.
/// @return the exit status: 0 only if the command has done its job and stdout took its output.
int runProgram(int argc, char** argv);

}  // namespace efm
