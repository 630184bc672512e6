// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <limits>

#include "mapping/geometry/camera.h"
#include "mapping/geometry/radial_distortion.h"

namespace efm {

/// The inverse of a lens: from raw pixels to viewing rays.
///
/// A distortion model need not have an inverse everywhere: it may fold the image over. A pixel has
/// a ray if the model projects this ray to the pixel, on the branch that begins at the centre: on
/// the way from the optical axis to the ray the model's Jacobian is positive definite. On this
/// branch Newton's method finds the ray, or there is none. From 89.994 degrees to the optical axis
/// on, where a ray is longer than 1e4, a pixel has no ray either.
class LensInverse {
 public:
  /// @throws std::invalid_argument where the model is not valid.
  explicit LensInverse(const CameraModel& model);

  /// (X/Z, Y/Z) of the ray through a raw pixel, frame `cam`. The model projects it back to the
  /// pixel within 1e-6 pixels. Not a number (both) where the pixel has no ray.
  /// @param near a ray near it, where one is known: saves half of the time.
  Eigen::Vector2d rayThrough(double x, double y, const Eigen::Vector2d& near = noRay()) const;
  static Eigen::Vector2d noRay() {
    return Eigen::Vector2d::Constant(std::numeric_limits<double>::quiet_NaN());
  }

 private:
  Eigen::Vector2d invertRadtan(const Eigen::Vector2d& distorted, const Eigen::Vector2d& near) const;
  Eigen::Vector2d newton(const Eigen::Vector2d& distorted, Eigen::Vector2d ray) const;
  Eigen::Vector2d invertEquidistant(const Eigen::Vector2d& distorted) const;
  bool isOnBranch(const Eigen::Vector2d& ray) const;

  struct Distorted {
    Eigen::Vector2d point;
    Eigen::Matrix2d by_ray;  // symmetric
  };
  Distorted distort(const Eigen::Vector2d& ray) const;

  CameraModel model_;
  double p1_ = 0, p2_ = 0;
  RadialDistortion radial_;
  RadialInverse inverse_;
  double max_r_ = 0;             // no distorted ray on the branch is longer
  double surely_on_branch_ = 0;  // rays up to this length are, whatever their direction
};

}  // namespace efm
