// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "mapping/geometry/depth_planes.h"

namespace efm::test {

/// Position of a depth between planes of inverse spacing: the inverse of `DepthPlanes::depthAt`.
inline double planePosition(const DepthPlanes& planes, double depth_m) {
  const double first = 1 / planes.depth(0);
  const double last = 1 / planes.depth(planes.size() - 1);
  return (1 / depth_m - first) / (last - first) * (planes.size() - 1);
}

}  // namespace efm::test
