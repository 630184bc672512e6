// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <exception>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "mapping/base/option.h"

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

/// An error in words for the user, and what it says of options.
struct UserError {
  std::string text;
  std::vector<OptionId> options{};     ///< Those that the text names.
  std::optional<OptionError> wrong{};  ///< The value that is out of range.
  std::string more{};                  ///< The end of the text, behind the error itself.

  void add(const std::string& end) {
    text += end;
    more += end;
  }
};
UserError userError(const std::exception& error);

/// The text alone: one sentence, without what a library adds for its
/// programmers (call stacks, places in its sources, names of types).
std::string inWords(const std::exception& error);

/// The program `event-fusion`: runs the command of the command line. Prints every error to stderr.
/// @return the process's exit status, one of those above: 0 only if the command has done its job
/// and stdout took its output.
int runProgram(int argc, char** argv);

}  // namespace efm
