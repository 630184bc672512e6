// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <cstdint>

namespace efm {

/// A point of a map. Double, because maps may lie far from the world's origin.
struct CloudPoint {
  Eigen::Vector3d p_world = Eigen::Vector3d::Zero();  ///< Metres, frame `world`.
  float confidence = 0;                               ///< Fused ray density at the point, above 0.
  std::uint32_t support = 1;                          ///< Number of keyframes that saw it.
};

}  // namespace efm
