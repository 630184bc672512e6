// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/geometry/lens_inverse.h"

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace efm {
namespace {

/// A longer ray is as good as perpendicular to the optical axis.
constexpr double kMaxRay = 1e4;
constexpr double kMaxErrorPx = 1e-6;

const CameraModel& validated(const CameraModel& model) {
  model.validate();
  return model;
}

RadialDistortion radialOf(const CameraModel& model) {
  const std::vector<double>& k = model.coefficients;
  switch (model.distortion) {
    case DistortionModel::kRadtan:
      return {{k[0], k[1], k.size() > 4 ? k[4] : 0, 0}, kMaxRay};
    case DistortionModel::kEquidistant:
      return {{k[0], k[1], k[2], k[3]}, std::atan(kMaxRay)};
    case DistortionModel::kNone:
      break;
  }
  return {{}, kMaxRay};
}

/// Distance of the farthest corner from the principal point, in units of the distorted ray.
double maxDistorted(const CameraModel& model) {
  const double x = std::max(std::abs(model.cx), std::abs(model.width - 1 - model.cx)) / model.fx;
  const double y = std::max(std::abs(model.cy), std::abs(model.height - 1 - model.cy)) / model.fy;
  return std::max(std::hypot(x, y), std::numeric_limits<double>::min());
}

bool isPositiveDefinite(const Eigen::Matrix2d& symmetric) {
  return symmetric.trace() > 0 && symmetric.determinant() > 0;
}

}  // namespace

LensInverse::LensInverse(const CameraModel& model)
    : model_(validated(model)), radial_(radialOf(model_)), inverse_(radial_, maxDistorted(model_)) {
  if (model_.distortion != DistortionModel::kRadtan) return;
  p1_ = model_.coefficients[2];
  p2_ = model_.coefficients[3];
  // The tangential part moves a ray by 3 |p| rho^2 at most, and the end of the branch with it.
  const double max_rho = (p1_ != 0 || p2_ != 0 ? 1.2 : 1.0) * radial_.maxRho();
  max_r_ = radial_.maxR() + 3 * std::hypot(p1_, p2_) * max_rho * max_rho;
  // The Jacobian's eigenvalues are those of the radial part, r / rho and dr / drho, changed by the
  // norm of the tangential part at most: 7 |p| rho.
  constexpr int kSteps = 256;
  const double step = radial_.maxRho() < kMaxRay
                          ? radial_.maxRho() / kSteps
                          : 2 * inverse_.guess(maxDistorted(model_)) / kSteps;
  for (int i = 1; i <= kSteps; ++i) {
    const double rho = i * step;
    if (std::min(radial_.ratioAt(rho * rho), radial_.slopeAt(rho * rho)) <=
        7 * std::hypot(p1_, p2_) * rho) {
      break;
    }
    surely_on_branch_ = rho;
  }
}

Eigen::Vector2d LensInverse::rayThrough(double x, double y, const Eigen::Vector2d& near) const {
  const Eigen::Vector2d distorted((x - model_.cx) / model_.fx, (y - model_.cy) / model_.fy);
  switch (model_.distortion) {
    case DistortionModel::kRadtan:
      return invertRadtan(distorted, near);
    case DistortionModel::kEquidistant:
      return invertEquidistant(distorted);
    case DistortionModel::kNone:
      break;
  }
  return distorted;
}

Eigen::Vector2d LensInverse::invertEquidistant(const Eigen::Vector2d& distorted) const {
  const double r = distorted.norm();
  if (r == 0) return distorted;
  const double theta = inverse_.at(r);
  const double error_px = std::abs(radial_.rAt(theta) - r) * std::max(model_.fx, model_.fy);
  if (!(error_px <= kMaxErrorPx)) return noRay();
  return std::tan(theta) / r * distorted;
}

Eigen::Vector2d LensInverse::invertRadtan(const Eigen::Vector2d& distorted,
                                          const Eigen::Vector2d& near) const {
  const double r = distorted.norm();
  if (r == 0) return distorted;
  if (r > max_r_) return noRay();
  if (!std::isnan(near.x())) {
    const Eigen::Vector2d ray = newton(distorted, near);
    if (!std::isnan(ray.x())) return ray;
  }
  // At the end of the branch itself the Jacobian has no inverse.
  const double rho = std::min(inverse_.guess(r), 0.99 * radial_.maxRho());
  return newton(distorted, rho / r * distorted);
}

/// Newton's method. The Jacobian is symmetric, so the ray is the minimum of a function that is
/// convex on the branch: steps that do not come nearer are halved.
Eigen::Vector2d LensInverse::newton(const Eigen::Vector2d& distorted, Eigen::Vector2d ray) const {
  constexpr int kMaxSteps = 50;
  constexpr int kMaxHalvings = 10;
  constexpr double kGoalPx = 1e-9;
  const double px = std::max(model_.fx, model_.fy);
  Distorted at = distort(ray);
  Eigen::Vector2d error = distorted - at.point;
  for (int step = 0; step < kMaxSteps && error.squaredNorm() * px * px > kGoalPx * kGoalPx;
       ++step) {
    Eigen::Vector2d change = at.by_ray.inverse() * error;
    Distorted next = distort(ray + change);
    const auto is_nearer = [&] {
      return (distorted - next.point).squaredNorm() < error.squaredNorm() &&
             isPositiveDefinite(next.by_ray);
    };
    for (int halving = 0; halving < kMaxHalvings && !is_nearer(); ++halving) {
      change *= 0.5;
      next = distort(ray + change);
    }
    if (!is_nearer()) break;
    ray += change;
    at = next;
    error = distorted - at.point;
  }
  const bool hits = error.squaredNorm() * px * px <= kMaxErrorPx * kMaxErrorPx;
  return hits && isOnBranch(ray) ? ray : noRay();
}

bool LensInverse::isOnBranch(const Eigen::Vector2d& ray) const {
  if (ray.squaredNorm() <= surely_on_branch_ * surely_on_branch_) return true;
  const double length = ray.norm();
  if (length > kMaxRay) return false;
  constexpr int kSteps = 32;
  const double start = surely_on_branch_ / length;
  for (int i = 1; i <= kSteps; ++i) {
    const double fraction = start + (1 - start) * i / kSteps;
    if (!isPositiveDefinite(distort(fraction * ray).by_ray)) return false;
  }
  return true;
}

LensInverse::Distorted LensInverse::distort(const Eigen::Vector2d& ray) const {
  const double x = ray.x();
  const double y = ray.y();
  const double xx = x * x;
  const double xy = x * y;
  const double yy = y * y;
  const double ratio = radial_.ratioAt(xx + yy);
  const double slope = 2 * radial_.ratioSlopeAt(xx + yy);
  Distorted result;
  result.point << x * ratio + 2 * p1_ * xy + p2_ * (3 * xx + yy),
      y * ratio + p1_ * (xx + 3 * yy) + 2 * p2_ * xy;
  const double mixed = slope * xy + 2 * (p1_ * x + p2_ * y);
  result.by_ray << ratio + slope * xx + 2 * p1_ * y + 6 * p2_ * x, mixed, mixed,
      ratio + slope * yy + 6 * p1_ * y + 2 * p2_ * x;
  return result;
}

}  // namespace efm
