// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "plugin/playback/error_text.h"

namespace efm {

/// While an object lives, the first SIGINT, SIGTERM or SIGHUP of the process requests a stop, and a
/// message appears on a terminal. A second signal ends the process at once, unless it comes within
/// 0.3 s of the first signal. Only one object may exist at a time.
class Interruption {
 public:
  Interruption();
  ~Interruption();
  Interruption(const Interruption&) = delete;
  Interruption& operator=(const Interruption&) = delete;

  /// Returns whether a signal came.
  bool requested() const;
  /// @throws Interrupted if a signal came.
  void check() const;
};

}  // namespace efm
