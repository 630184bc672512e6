// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <stdexcept>

namespace efm {

/// While it lives, the first SIGINT, SIGTERM or SIGHUP of the process is a request to stop, and a terminal
/// says so. A second one ends the process at once, unless it comes within 0.3 s of the first. One
/// object at a time.
class Interruption {
 public:
  Interruption();
  ~Interruption();
  Interruption(const Interruption&) = delete;
  Interruption& operator=(const Interruption&) = delete;

  /// Whether a signal came.
  bool requested() const;
  /// @throws Interrupted if a signal came.
  void check() const;
};

/// Ends a command that was interrupted and has no result.
class Interrupted : public std::runtime_error {
 public:
  Interrupted() : std::runtime_error("stopped by a signal: there is no result") {}
};

}  // namespace efm
