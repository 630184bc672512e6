// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>

#include <optional>

#include "tracking_stub/scenes/scene.h"

namespace efm {

/// The first hit of a ray.
struct RayHit {
  double distance_m = 0;  ///< Distance along the ray.
  Eigen::Vector3d p_world = Eigen::Vector3d::Zero();
  SurfacePoint point;
};

/// Returns the first surface on a ray, by plain geometry. `SceneView` must find the same surface.
/// @param direction frame `world`, any length above 0.
std::optional<RayHit> castRay(const Scene& scene, const Eigen::Vector3d& origin,
                              const Eigen::Vector3d& direction);

/// The nearest surface to a point.
struct NearestSurface {
  int surface = -1;       ///< Index; -1 if the scene is empty.
  double distance_m = 0;  ///< Distance to the surface; infinite if the scene is empty.
};

/// Returns the nearest surface; both sides count. If two surfaces are equally near, the first one
/// is returned. Cost: the distance to one plane per surface.
NearestSurface nearestSurface(const Scene& scene, const Eigen::Vector3d& p_world);

}  // namespace efm
