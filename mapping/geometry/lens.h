// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>

#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <memory>
#include <vector>

#include "mapping/geometry/rig.h"

namespace efm {

/// The radial part of a lens: r = rho (1 + k1 rho^2 + k2 rho^4 + k3 rho^6 + k4 rho^8). It is
/// inverted on the branch that begins at the centre. The branch ends where the polynomial begins to
/// fall, because the model folds the image over there.
class RadialDistortion {
 public:
  /// @param coefficients k1, k2 ...
  /// @param max_rho largest rho of the branch, unless the polynomial falls before.
  RadialDistortion(const std::array<double, 4>& coefficients, double max_rho);

  /// Returns r / rho from s = rho^2.
  double ratioAt(double s) const { return 1 + s * (k_[0] + s * (k_[1] + s * (k_[2] + s * k_[3]))); }
  /// Returns the derivative of r / rho by s.
  double ratioSlopeAt(double s) const {
    return k_[0] + s * (2 * k_[1] + s * (3 * k_[2] + s * 4 * k_[3]));
  }
  /// Returns dr / drho from s.
  double slopeAt(double s) const { return ratioAt(s) + 2 * s * ratioSlopeAt(s); }
  double rAt(double rho) const { return rho * ratioAt(rho * rho); }
  /// Returns rho at the end of the branch.
  double maxRho() const { return max_rho_; }
  double maxR() const { return rAt(max_rho_); }

 private:
  std::array<double, 4> k_;
  double max_rho_;
};

/// The inverse of a radial distortion: a table for the first guess, then Newton's method.
class RadialInverse {
 public:
  /// @param max_r end of the table. A larger r is inverted too, but more slowly.
  RadialInverse(const RadialDistortion& distortion, double max_r);

  /// Returns a rho with almost this r. If r is beyond `max_r` or the branch: the rho at that end.
  double guess(double r) const;
  /// Returns the rho of this r; NaN if the branch ends before this r.
  double at(double r) const;

 private:
  double solve(double r, double low, double high, double start) const;

  RadialDistortion distortion_;
  double max_r_;
  double nodes_per_r_;
  std::vector<double> rho_;  // at nodes evenly spaced in r
};

/// The inverse of a lens: from raw pixels to viewing rays.
///
/// A distortion model may have no inverse in a part of the image, because it may fold the image
/// over. A pixel has a ray if the model projects the ray to the pixel and the ray is on the branch
/// that begins at the centre: the model's Jacobian is positive definite all the way from the
/// optical axis to the ray. Newton's method finds the ray if it exists. Rays at more than 89.994
/// degrees to the optical axis, which are longer than 1e4, are not used: their pixels have no ray.
class LensInverse {
 public:
  explicit LensInverse(const CameraModel& model);

  /// Returns (X/Z, Y/Z) of the ray through a raw pixel, frame `cam`. The model projects it back to
  /// the pixel within 1e-6 pixels. Both are NaN if the pixel has no ray.
  /// @param near a ray close to the result, if one is known: saves half of the time.
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
  double max_r_ = 0;             // upper bound of the length of distorted rays on the branch
  double surely_on_branch_ = 0;  // rays up to this length are on it, in any direction
};

/// The viewing ray of every pixel of one camera: computed once, then looked up per event. Tables of
/// the same lens share their rays: as long as one table exists, further ones cost nothing.
///
/// Rays are stored as floats: a look-up is a random access to memory, and the smaller table fits
/// the caches better. The relative rounding error of a ray is at most 2^-25: 2e-5 pixels at the
/// corner of an HD image.
class UndistortionTable {
 public:
  /// Inverts the lens once per pixel. Cost: some 50 ns of processor time per pixel, rows in
  /// parallel on the threads of the caller's task arena. Memory: 8 bytes per pixel.
  explicit UndistortionTable(const CameraModel& model);

  int width() const { return width_; }
  int height() const { return height_; }

  /// Returns (X/Z, Y/Z) of the ray through the centre of raw pixel (x, y), frame `cam`. Both are
  /// NaN if the pixel lies outside the lens (`LensInverse`).
  Eigen::Vector2d ray(int x, int y) const {
    const auto row = static_cast<std::size_t>(y) * static_cast<std::size_t>(width_);
    return (*rays_)[row + static_cast<std::size_t>(x)].cast<double>();
  }
  bool hasRay(int x, int y) const { return !std::isnan(ray(x, y).x()); }
  /// Returns the ray of pixel (x, y), or else the ray of the next pixel with a ray, on the line
  /// from (x, y) to the optical axis.
  Eigen::Vector2d rayNear(int x, int y) const;
  /// Returns for each pixel, row-major, whether it lies outside the lens. Empty if no pixel does.
  std::vector<bool> outsideLens() const;
  /// Returns the rays of all pixels, row-major: pixel (x, y) has element y * width() + x.
  const Eigen::Vector2f* rays() const { return rays_->data(); }

 private:
  int width_ = 0;
  int height_ = 0;
  int center_x_ = 0;  // this pixel has a ray
  int center_y_ = 0;
  std::shared_ptr<const std::vector<Eigen::Vector2f>> rays_;  // row-major
};

}  // namespace efm
