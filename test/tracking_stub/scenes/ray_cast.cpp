// SPDX-License-Identifier: BSD-3-Clause
#include "test/tracking_stub/scenes/ray_cast.h"

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
    if (!(approach > 0) || !(height > 0)) continue;  // parallel, or from behind
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

}  // namespace efm
