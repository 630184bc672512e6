// SPDX-License-Identifier: BSD-3-Clause
#pragma once

namespace efm {

/// While it lives, the first SIGINT or SIGTERM of the process is a request to stop. The second one
/// ends the process. One object at a time.
class Interruption {
 public:
  Interruption();
  ~Interruption();
  Interruption(const Interruption&) = delete;
  Interruption& operator=(const Interruption&) = delete;

  /// Whether a signal came.
  bool requested() const;
};

}  // namespace efm
