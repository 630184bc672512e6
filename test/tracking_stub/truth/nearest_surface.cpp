// SPDX-License-Identifier: BSD-3-Clause
#include "test/tracking_stub/truth/nearest_surface.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace efm {

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
