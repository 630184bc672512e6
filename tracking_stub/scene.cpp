// SPDX-License-Identifier: BSD-3-Clause
#include "tracking_stub/scene.h"

#include <utility>

namespace efm {

int Scene::addRectangle(const Rectangle& rectangle, const Painter& paint) {
  rectangles_.push_back(rectangle);
  textures_.push_back(paint(rectangle.width_m, rectangle.height_m));
  return size() - 1;
}

void Scene::addBox(const Rigid3& T_world_box, const Eigen::Vector3d& size_m, const Painter& paint) {
  for (int axis = 0; axis < 3; ++axis) {
    for (const double side : {-1.0, 1.0}) {
      // u x v points along +axis; exchanging them turns the face to the other side.
      int u = (axis + 1) % 3;
      int v = (axis + 2) % 3;
      if (side < 0) std::swap(u, v);
      Eigen::Vector3d corner_box = -0.5 * size_m;
      corner_box[axis] = 0.5 * side * size_m[axis];
      addRectangle({T_world_box * corner_box, T_world_box.rotation * Eigen::Vector3d::Unit(u),
                    T_world_box.rotation * Eigen::Vector3d::Unit(v), size_m[u], size_m[v]},
                   paint);
    }
  }
}

std::optional<RayHit> Scene::cast(const Eigen::Vector3d& origin,
                                  const Eigen::Vector3d& direction) const {
  const Eigen::Vector3d unit = direction.normalized();
  std::optional<RayHit> nearest;
  for (int surface = 0; surface < size(); ++surface) {
    const Rectangle& r = rectangle(surface);
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
