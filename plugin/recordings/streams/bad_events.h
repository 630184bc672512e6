// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <string>

namespace efm {

/// Counts the bad events of a recording that are left out, over all its cameras, up to a limit.
class BadEvents {
 public:
  /// @param limit of `--skip-bad-events`.
  explicit BadEvents(std::uint64_t limit) : limit_(limit) {}

  /// Leaves out one more bad event.
  /// @param error the position, the value and what was expected.
  /// @throws std::runtime_error: the error and the option, where there are more than the limit.
  void skip(const std::string& error);

  std::uint64_t count() const { return count_; }
  /// The error of the first one that was found: lines that are none are found before the wrong
  /// events of their block.
  const std::string& first() const { return first_; }

 private:
  std::uint64_t limit_;
  std::uint64_t count_ = 0;
  std::string first_;
};

}  // namespace efm
