// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <opencv2/core.hpp>

#include <functional>
#include <vector>

#include "mapping/geometry/rigid3.h"

namespace efm {

/// Log intensity painted on a plane, sampled without aliasing: a pyramid of Gaussian blurs with
/// trilinear interpolation. The blur models lens and pixel. It acts on log intensity: the position
/// of an edge does not depend on the intensities of its two sides.
class Texture {
 public:
  /// @param log_intensity the painting; texel (i, j) covers [i, i+1) x [j, j+1) times `texel_m`.
  Texture(const cv::Mat1f& log_intensity, double texel_m);

  /// Returns log intensity at (u, v) metres from the painting's corner, with a Gaussian blur of
  /// standard deviation `sigma_m` (at least one texel). Outside, the border is repeated.
  float sample(double u_m, double v_m, double sigma_m) const;

 private:
  struct Level {
    cv::Mat1f image;  // continuous; blurred with a standard deviation of one of its texels
    float texels_per_m = 0;
  };
  static float sampleLevel(const Level& level, double u_m, double v_m);

  std::vector<Level> levels_;
};

/// A flat rectangle: the points corner + u axis_u + v axis_v, 0 <= u <= width, 0 <= v <= height,
/// frame `world`, metres. It is visible only from the side of its normal, axis_u x axis_v.
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

/// A point on a surface of a scene.
struct SurfacePoint {
  int surface = -1;  ///< Index of the surface; -1 if a ray hits nothing.
  float u_m = 0;
  float v_m = 0;
};

/// A prism with eight sides: a thin pole, a lamp post or the leg of a table.
struct Pole {
  Rigid3 T_world_pole;     ///< Frame `pole`: origin in the middle, z along the pole.
  double radius_m = 0.02;  ///< Distance between the corners and the axis, above 0.
  double length_m = 1;
};

/// Textured rectangles in the world.
class Scene {
 public:
  /// Makes the texture of a surface.
  using Painter = std::function<Texture(double width_m, double height_m)>;

  /// Adds a surface. @return the index of the surface.
  int addRectangle(const Rectangle& rectangle, const Painter& paint);
  /// Adds six rectangles, visible from outside. The origin of frame `box` is the centre of the box.
  void addBox(const Rigid3& T_world_box, const Eigen::Vector3d& size_m, const Painter& paint);

  /// Adds a rectangle per facet, with u around the pole and v along it. Each end is the union of
  /// rectangles between opposite facets. They overlap, so `paint` must paint all of them equally.
  void addPole(const Pole& pole, const Painter& paint);

  /// Moves all surfaces: a point p moves to T_world_old * p.
  void move(const Rigid3& T_world_old);

  int size() const { return static_cast<int>(rectangles_.size()); }
  const Rectangle& rectangle(int surface) const {
    return rectangles_[static_cast<std::size_t>(surface)];
  }
  const Texture& texture(int surface) const { return textures_[static_cast<std::size_t>(surface)]; }
  Eigen::Vector3d pointAt(const SurfacePoint& point) const {
    return rectangle(point.surface).pointAt(point.u_m, point.v_m);
  }

 private:
  std::vector<Rectangle> rectangles_;
  std::vector<Texture> textures_;
};

}  // namespace efm
