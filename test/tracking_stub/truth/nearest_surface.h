// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>

#include <optional>

#include "tracking_stub/scenes/scene.h"

namespace efm {

/// The first hit of a ray.
struct RayHit {
  double distance_m = 0;  ///< Along the ray.
  Eigen::Vector3d p_world = Eigen::Vector3d::Zero();
  SurfacePoint point;
};

/// The first surface on a ray, by plain geometry. SceneView must find the same.
/// @param direction frame `world`, any length above 0.
std::optional<RayHit> castRay(const Scene& scene, const Eigen::Vector3d& origin,
                              const Eigen::Vector3d& direction);

/// The nearest surface to a point.
struct NearestSurface {
  int surface = -1;       ///< Index; -1 where the scene is empty.
  double distance_m = 0;  ///< To its nearest point; infinite where the scene is empty.
};

/// Counts both sides of a surface. Of equally near surfaces it returns the first. Cost: a plane's
/// distance for every surface.
NearestSurface nearestSurface(const Scene& scene, const Eigen::Vector3d& p_world);

}  // namespace efm
