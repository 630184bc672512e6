// SPDX-License-Identifier: BSD-3-Clause
#include "tracking_stub/scenes/scene.h"

#include <cmath>
#include <utility>

#include "mapping/base/named_choice.h"
#include "mapping/geometry/rigid3.h"

namespace efm {

int Scene::addRectangle(const Rectangle& rectangle, const Painter& paint) {
  rectangles_.push_back(rectangle);
  textures_.push_back(paint(rectangle.width_m, rectangle.height_m));
  return size() - 1;
}

void Scene::addBox(const Rigid3& T_world_box, const Eigen::Vector3d& size_m, const Painter& paint) {
  for (int axis = 0; axis < 3; ++axis) {
    for (const double side : {-1.0, 1.0}) {
      // u x v points along +axis. The opposite face exchanges u and v.
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

void Scene::addPole(const Pole& pole, const Painter& paint) {
  requireOption(pole.radius_m > 0, "radius_m", pole.radius_m, "above 0");
  requireOption(pole.length_m > 0, "length_m", pole.length_m, "above 0");
  requireOption(pole.facets >= 4 && pole.facets % 2 == 0, "facets", pole.facets,
                "even, at least 4");
  const double half_angle = kPi / pole.facets;
  const double width = 2 * pole.radius_m * std::sin(half_angle);
  const double apothem = pole.radius_m * std::cos(half_angle);
  const Eigen::Quaterniond& R_world_pole = pole.T_world_pole.rotation;
  const Eigen::Vector3d along = R_world_pole * Eigen::Vector3d::UnitZ();
  const Eigen::Vector3d foot = pole.T_world_pole.translation - 0.5 * pole.length_m * along;
  for (int facet = 0; facet < pole.facets; ++facet) {
    const double angle = 2 * half_angle * facet;
    const Eigen::Vector3d outward =
        R_world_pole * Eigen::Vector3d(std::cos(angle), std::sin(angle), 0);
    const Eigen::Vector3d around = along.cross(outward);
    const Eigen::Vector3d edge = -0.5 * width * around;
    addRectangle({foot + apothem * outward + edge, around, along, width, pole.length_m}, paint);
    if (facet >= pole.facets / 2) continue;
    const Eigen::Vector3d across = -apothem * outward + edge;
    addRectangle({foot + pole.length_m * along + across, outward, around, 2 * apothem, width},
                 paint);
    addRectangle({foot + across, around, outward, width, 2 * apothem}, paint);
  }
}

void Scene::move(const Rigid3& T_world_old) {
  for (Rectangle& r : rectangles_) {
    r.corner = T_world_old * r.corner;
    r.axis_u = T_world_old.rotation * r.axis_u;
    r.axis_v = T_world_old.rotation * r.axis_v;
  }
}

}  // namespace efm
