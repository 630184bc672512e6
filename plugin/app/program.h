// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <chrono>
#include <exception>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

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

/// The HDF5 library crashes on some damaged files, or does not return from them. So the program
/// starts itself a second time, for the beginning of each HDF5 file of its command line, before it
/// reads them. That is the program's own: a library cannot start its host again, and a copy of a
/// process with threads (`fork`) may stop at a lock.

/// The command line of the second program is this and a file or folder.
inline constexpr std::string_view kHdf5Trial = "--try-hdf5";

/// Reads the beginning of a file or folder. Errors are left to the first program.
/// @return the exit status: 0.
int runHdf5Trial(const std::string& source);

/// Starts the second program for each argument that is an HDF5 file, or a folder with one.
/// @throws std::runtime_error naming the argument on which it crashes, or takes over a minute.
void tryHdf5(const std::vector<std::string>& arguments);

/// Runs a program without input and output.
/// @param command its file and its arguments.
/// @return how it failed: "crashes", "does not end within 60 s"; nothing if it ended with status
/// 0, or cannot be started.
std::optional<std::string> failureOf(const std::vector<std::string>& command,
                                     std::chrono::milliseconds limit);

/// The program `event-fusion`: runs the command of the command line. Prints every error to stderr.
/// @return the process's exit status, one of those above: 0 only if the command has done its job
/// and stdout took its output.
int runProgram(int argc, char** argv);

}  // namespace efm
