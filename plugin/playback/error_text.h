// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <exception>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "mapping/base/option.h"

namespace efm {

/// Error of a command that was interrupted and has no result.
class Interrupted : public std::runtime_error {
 public:
  Interrupted() : std::runtime_error("stopped by a signal: there is no result") {}
};

/// Error as text for the user, and the options that it concerns.
struct UserError {
  std::string text;
  std::vector<OptionId> options{};     ///< Options that the text names.
  std::optional<OptionError> wrong{};  ///< Option whose value is out of range.
  std::string more{};                  ///< End of the text, after the error itself.

  void add(const std::string& end) {
    text += end;
    more += end;
  }
};
UserError userError(const std::exception& error);

/// Returns whether an error may be gone at the next try: no memory, no room on the disk, or another
/// process at work. @param text of UserError.
bool isTemporary(std::string_view text);

/// Returns the text of the error only: one sentence, without the additions of libraries for
/// programmers (call stacks, places in sources, names of types).
std::string userMessage(const std::exception& error);

}  // namespace efm
