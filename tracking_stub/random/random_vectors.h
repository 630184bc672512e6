// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>

#include "tracking_stub/random/random_numbers.h"

namespace efm {

/// Normal on each axis, of standard deviation 1.
inline Eigen::Vector3d normalVector(RandomNumbers& random) {
  Eigen::Vector3d values;
  for (int axis = 0; axis < 3; ++axis) values[axis] = random.normal();
  return values;
}

/// Uniform on the unit sphere.
inline Eigen::Vector3d randomDirection(RandomNumbers& random) {
  return normalVector(random).normalized();
}

}  // namespace efm
