// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>

#include "mapping/geometry/trajectory.h"

namespace efm {

/// Where poses come from: what a real tracker implements. Called from one thread.
class PoseSource {
 public:
  virtual ~PoseSource() = default;

  /// The next pose in order of time. @return nothing when there is none for now: poll again, unless
  /// `ended`.
  virtual std::optional<StampedPose> next() = 0;

  /// True once no pose will ever come again.
  virtual bool ended() const = 0;
};

}  // namespace efm
