// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <functional>
#include <optional>
#include <vector>

#include "mapping/geometry/rigid3.h"
#include "tracking_stub/scenes/texture.h"

namespace efm {

/// A flat rectangle: the points corner + u axis_u + v axis_v, 0 <= u <= width, 0 <= v <= height,
/// frame `world`, metres. Seen only from the side that its normal, axis_u x axis_v, points to.
///
/// Invariant: the axes are orthogonal and of unit length.
struct Rectangle {
  Eigen::Vector3d corner = Eigen::Vector3d::Zero();
  Eigen::Vector3d axis_u = Eigen::Vector3d::UnitX();
  Eigen::Vector3d axis_v = Eigen::Vector3d::UnitY();
  double width_m = 1;
  double height_m = 1;

  Eigen::Vector3d normal() const { return axis_u.cross(axis_v); }
  Eigen::Vector3d pointAt(double u_m, double v_m) const {
    return corner + u_m * axis_u + v_m * axis_v;
  }
};

/// A place on one of a scene's surfaces.
struct SurfacePoint {
  int surface = -1;  ///< Index; -1 where a ray met nothing.
  float u_m = 0;
  float v_m = 0;
};

/// Where a ray first met a surface.
struct RayHit {
  double distance_m = 0;  ///< Along the ray.
  Eigen::Vector3d p_world = Eigen::Vector3d::Zero();
  SurfacePoint place;
};

/// An upright prism that stands for a thin pole, a lamp post or the leg of a table.
struct Pole {
  Rigid3 T_world_pole;     ///< Frame `pole`: origin in its middle, z along it.
  double radius_m = 0.02;  ///< Of the corners, above 0.
  double length_m = 1;
  int facets = 8;  ///< Even, at least 4.
};

/// Textured rectangles in the world.
class Scene {
 public:
  /// Paints a surface of a size (width, height in metres).
  using Painter = std::function<Texture(double width_m, double height_m)>;

  /// @return the index of the surface.
  int addRectangle(const Rectangle& rectangle, const Painter& paint);
  /// Six rectangles, seen from outside; frame `box` has its origin at the centre of the box.
  void addBox(const Rigid3& T_world_box, const Eigen::Vector3d& size_m, const Painter& paint);

  /// As many rectangles as it has facets, with u around the pole and v along it, and at both ends
  /// half as many that overlap: rectangles between opposite facets, which together are the regular
  /// polygon. Each is painted, so paint alike what lies in one place.
  /// @throws std::invalid_argument where the pole is not valid.
  void addPole(const Pole& pole, const Painter& paint);

  /// Moves all there is: what was at p is at T_world_old * p.
  void move(const Rigid3& T_world_old);

  int size() const { return static_cast<int>(rectangles_.size()); }
  const Rectangle& rectangle(int surface) const {
    return rectangles_[static_cast<std::size_t>(surface)];
  }
  const Texture& texture(int surface) const { return textures_[static_cast<std::size_t>(surface)]; }
  Eigen::Vector3d pointAt(const SurfacePoint& place) const {
    return rectangle(place.surface).pointAt(place.u_m, place.v_m);
  }

  /// The first surface that a ray from `origin` meets. The plain specification of what SceneView
  /// finds faster.
  /// @param direction frame `world`, any length above 0.
  std::optional<RayHit> cast(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction) const;

 private:
  std::vector<Rectangle> rectangles_;
  std::vector<Texture> textures_;
};

}  // namespace efm
