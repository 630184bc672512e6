// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Geometry>

namespace efm {

/// The turn about a vector's direction by its length in radians: the exponential map of SO(3).
inline Eigen::Quaterniond turnBy(const Eigen::Vector3d& rotation_vector) {
  const double angle = rotation_vector.norm();
  if (angle <= 0) return Eigen::Quaterniond::Identity();
  return Eigen::Quaterniond(Eigen::AngleAxisd(angle, rotation_vector / angle));
}

}  // namespace efm
