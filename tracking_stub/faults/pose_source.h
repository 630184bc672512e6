// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>

#include "mapping/geometry/trajectory.h"

namespace efm {

/// A source of poses. A real tracker implements it. Called from one thread.
class PoseSource {
 public:
  virtual ~PoseSource() = default;

  /// The next pose in order of time.
  /// @return nothing when no pose is available now. Poll again, unless `ended`.
  virtual std::optional<StampedPose> next() = 0;

  /// Whether no more poses will come.
  virtual bool ended() const = 0;
};

}  // namespace efm
