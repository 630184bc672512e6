// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>

#include "tracking_stub/scenes/scene.h"

namespace efm {

/// The surface of a scene that a point is nearest to.
struct NearestSurface {
  int surface = -1;       ///< Index; -1 where the scene is empty.
  double distance_m = 0;  ///< To its nearest point; infinite where the scene is empty.
};

/// From whichever side: a point behind a surface is as near as one before it. Of surfaces that are
/// equally near, the first. Cost: a plane's distance for every surface.
NearestSurface nearestSurface(const Scene& scene, const Eigen::Vector3d& p_world);

}  // namespace efm
