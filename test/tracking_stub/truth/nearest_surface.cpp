// SPDX-License-Identifier: BSD-3-Clause
#include "test/tracking_stub/truth/nearest_surface.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace efm {

std::optional<RayHit> castRay(const Scene& scene, const Eigen::Vector3d& origin,
                              const Eigen::Vector3d& direction) {
  const Eigen::Vector3d unit = direction.normalized();
  std::optional<RayHit> nearest;
  for (int surface = 0; surface < scene.size(); ++surface) {
    const Rectangle& r = scene.rectangle(surface);
    const Eigen::Vector3d normal = r.normal();
    const double approach = -normal.dot(unit);
    const double height = normal.dot(origin - r.corner);
    if (!(approach > 0) || !(height > 0)) continue;  // parallel or from behind
    const double distance = height / approach;
    if (nearest && nearest->distance_m <= distance) continue;
    const Eigen::Vector3d p_world = origin + distance * unit;
    const double u = r.axis_u.dot(p_world - r.corner);
    const double v = r.axis_v.dot(p_world - r.corner);
    if (u < 0 || u > r.width_m || v < 0 || v > r.height_m) continue;
    nearest = RayHit{distance, p_world, {surface, static_cast<float>(u), static_cast<float>(v)}};
  }
  return nearest;
}

NearestSurface nearestSurface(const Scene& scene, const Eigen::Vector3d& p_world) {
  NearestSurface nearest{-1, std::numeric_limits<double>::infinity()};
  for (int surface = 0; surface < scene.size(); ++surface) {
    const Rectangle& rectangle = scene.rectangle(surface);
    const Eigen::Vector3d from_corner = p_world - rectangle.corner;
    // A rectangle is never nearer than its plane: most are skipped.
    if (std::abs(from_corner.dot(rectangle.normal())) >= nearest.distance_m) continue;
    const double u = std::clamp(from_corner.dot(rectangle.axis_u), 0.0, rectangle.width_m);
    const double v = std::clamp(from_corner.dot(rectangle.axis_v), 0.0, rectangle.height_m);
    const double distance_m = (p_world - rectangle.pointAt(u, v)).norm();
    if (distance_m < nearest.distance_m) nearest = {surface, distance_m};
  }
  return nearest;
}

}  // namespace efm
