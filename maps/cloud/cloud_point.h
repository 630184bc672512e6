// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <limits>
#include <string>

namespace efm {

/// A point on its way into a map, or from a file of any origin. Double, because maps may lie far
/// from the origin of the world. A map gives its points as a cloud of PCL (`MapPoint`).
struct CloudPoint {
  Eigen::Vector3d p_world = Eigen::Vector3d::Zero();  ///< Metres, frame `world`.
  float confidence = 0;                               ///< Fused ray density at the point, above 0.
  std::uint32_t support = 1;                          ///< Number of keyframes that saw it.
  /// Of a global cloud: the lowest number of a keyframe that saw it.
  std::uint64_t first_keyframe = 0;
  /// Standard deviation of depth, metres; NaN where it is not known.
  float sigma = std::numeric_limits<float>::quiet_NaN();
};

/// For messages, with all digits: "(1, 2.5, -3)".
std::string positionText(const CloudPoint& point);
/// For messages, with all digits: "(1, 2.5, -3) with confidence 7".
std::string pointText(const CloudPoint& point);

}  // namespace efm
