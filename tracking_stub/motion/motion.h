// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>

#include "mapping/geometry/rigid3.h"

namespace efm {

/// A motion that is known at every time.
class Motion {
 public:
  virtual ~Motion() = default;
  /// T_world_rig. Thread-safe.
  virtual Rigid3 poseAt(std::int64_t t_ns) const = 0;
};

}  // namespace efm
