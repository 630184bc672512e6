// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/geometry/lens.h"

#include <tbb/parallel_for.h>
#include <Eigen/LU>

#include <algorithm>
#include <mutex>
#include <stdexcept>

namespace efm {
namespace {

/// Coefficients of 1, s, s^2 ...
using Polynomial = std::vector<double>;

double valueOf(const Polynomial& polynomial, double s) {
  double value = 0;
  for (auto c = polynomial.rbegin(); c != polynomial.rend(); ++c) value = value * s + *c;
  return value;
}

/// Returns the places in (0, end) where the polynomial changes its sign, ascending. Between two
/// neighbouring extremes there is at most one sign change.
std::vector<double> signChanges(const Polynomial& polynomial, double end) {
  if (polynomial.size() < 2) return {};
  Polynomial derivative;
  for (std::size_t i = 1; i < polynomial.size(); ++i) {
    derivative.push_back(static_cast<double>(i) * polynomial[i]);
  }
  std::vector<double> borders = signChanges(derivative, end);
  borders.push_back(end);
  std::vector<double> changes;
  double low = 0;
  for (const double border : borders) {
    const bool positive = valueOf(polynomial, low) > 0;
    double left = low;
    double right = border;
    low = border;
    if ((valueOf(polynomial, right) > 0) == positive) continue;
    for (double middle = 0.5 * (left + right); left < middle && middle < right;
         middle = 0.5 * (left + right)) {
      ((valueOf(polynomial, middle) > 0) == positive ? left : right) = middle;
    }
    changes.push_back(left);
  }
  return changes;
}

}  // namespace

RadialDistortion::RadialDistortion(const std::array<double, 4>& coefficients, double max_rho)
    : k_(coefficients), max_rho_(max_rho) {
  const Polynomial slope = {1, 3 * k_[0], 5 * k_[1], 7 * k_[2], 9 * k_[3]};
  const std::vector<double> folds = signChanges(slope, max_rho * max_rho);
  if (!folds.empty()) max_rho_ = std::sqrt(folds.front());
}

RadialInverse::RadialInverse(const RadialDistortion& distortion, double max_r)
    : distortion_(distortion), max_r_(std::min(max_r, distortion.maxR())) {
  constexpr std::size_t kIntervals = 1024;
  nodes_per_r_ = static_cast<double>(kIntervals) / max_r_;
  rho_ = {0};
  while (rho_.size() <= kIntervals) {
    const double r = static_cast<double>(rho_.size()) / nodes_per_r_;
    rho_.push_back(solve(r, rho_.back(), distortion_.maxRho(), rho_.back()));
  }
}

double RadialInverse::guess(double r) const {
  const double position = std::min(r, max_r_) * nodes_per_r_;
  const std::size_t node = std::min(static_cast<std::size_t>(position), rho_.size() - 2);
  const double fraction = position - static_cast<double>(node);
  return rho_[node] + fraction * (rho_[node + 1] - rho_[node]);
}

double RadialInverse::at(double r) const {
  if (!(r <= distortion_.maxR())) return std::numeric_limits<double>::quiet_NaN();
  if (r > max_r_) return solve(r, rho_.back(), distortion_.maxRho(), rho_.back());
  const std::size_t node = std::min(static_cast<std::size_t>(r * nodes_per_r_), rho_.size() - 2);
  double rho = guess(r);
  rho -= (distortion_.rAt(rho) - r) / distortion_.slopeAt(rho * rho);
  const bool found = rho >= rho_[node] && rho <= rho_[node + 1] &&
                     std::abs(distortion_.rAt(rho) - r) <= 1e-14 * r;  // true for almost all r
  return found ? rho : solve(r, rho_[node], rho_[node + 1], guess(r));
}

/// Solves rAt(rho) = r in [low, high], where r grows with rho. Bisects if a Newton step leaves it.
double RadialInverse::solve(double r, double low, double high, double start) const {
  constexpr int kMaxSteps = 100;
  double rho = start;
  for (int step = 0; step < kMaxSteps; ++step) {
    const double error = distortion_.rAt(rho) - r;
    (error > 0 ? high : low) = rho;
    double next = rho - error / distortion_.slopeAt(rho * rho);
    if (!(next >= low && next <= high)) next = 0.5 * (low + high);
    if (std::abs(next - rho) <= 1e-15 * rho) return next;
    rho = next;
  }
  return rho;
}

namespace {

/// A longer ray is almost perpendicular to the optical axis.
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

/// Returns the distance of the farthest corner from the principal point, as a distorted ray.
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
  // The tangential part moves a ray, and the end of the branch with it, by at most 3 |p| rho^2.
  const double max_rho = (p1_ != 0 || p2_ != 0 ? 1.2 : 1.0) * radial_.maxRho();
  max_r_ = radial_.maxR() + 3 * std::hypot(p1_, p2_) * max_rho * max_rho;
  // The eigenvalues of the radial Jacobian are r / rho and dr / drho. The tangential part changes
  // them by at most its norm, 7 |p| rho.
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
  // The guess stays below the end of the branch, where the Jacobian has no inverse.
  const double rho = std::min(inverse_.guess(r), 0.99 * radial_.maxRho());
  return newton(distorted, rho / r * distorted);
}

/// Inverts the lens by Newton's method. The Jacobian is symmetric, so the ray is the minimum of a
/// function that is convex on the branch: a step that does not reduce the error is halved.
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

namespace {

using Rays = std::vector<Eigen::Vector2f>;

Rays raysThrough(const CameraModel& model) {
  const LensInverse lens(model);
  Rays rays(static_cast<std::size_t>(model.width) * static_cast<std::size_t>(model.height));
  tbb::parallel_for(0, model.height, [&](int y) {
    const auto row = rays.begin() + static_cast<std::ptrdiff_t>(y) * model.width;
    Eigen::Vector2d before = LensInverse::noRay();
    Eigen::Vector2d last = before;
    for (int x = 0; x < model.width; ++x) {
      const Eigen::Vector2d ray = lens.rayThrough(x, y, 2 * last - before);
      row[x] = ray.cast<float>();
      before = last;
      last = ray;
    }
  });
  return rays;
}

/// Returns the rays of a lens: those of a table that exists, if there is one.
std::shared_ptr<const Rays> sharedRays(const CameraModel& model) {
  struct Lens {
    CameraModel model;
    std::weak_ptr<const Rays> rays;
  };
  static std::mutex mutex;
  static std::vector<Lens> lenses;
  {
    const std::lock_guard lock(mutex);
    for (const Lens& lens : lenses) {
      if (auto rays = lens.rays.lock(); rays && lens.model == model) return rays;
    }
  }
  // Without the lock: while a thread waits for the rows, it may make another table.
  auto rays = std::make_shared<const Rays>(raysThrough(model));
  const std::lock_guard lock(mutex);
  const auto is_gone = [](const Lens& lens) { return lens.rays.expired(); };
  lenses.erase(std::remove_if(lenses.begin(), lenses.end(), is_gone), lenses.end());
  lenses.push_back({model, rays});
  return rays;
}

}  // namespace

UndistortionTable::UndistortionTable(const CameraModel& model)
    : width_(model.width), height_(model.height), rays_(sharedRays(model)) {
  center_x_ = static_cast<int>(std::clamp(model.cx, 0.0, width_ - 1.0));
  center_y_ = static_cast<int>(std::clamp(model.cy, 0.0, height_ - 1.0));
  if (hasRay(center_x_, center_y_)) return;
  const auto seen = std::find_if(rays_->begin(), rays_->end(),
                                 [](const Eigen::Vector2f& ray) { return !std::isnan(ray.x()); });
  if (seen == rays_->end()) {
    throw std::invalid_argument(
        "the lens: no pixel of the sensor has a viewing ray by its distortion coefficients and "
        "principal point");
  }
  center_x_ = static_cast<int>((seen - rays_->begin()) % width_);
  center_y_ = static_cast<int>((seen - rays_->begin()) / width_);
}

Eigen::Vector2d UndistortionTable::rayNear(int x, int y) const {
  const int steps = std::max({std::abs(center_x_ - x), std::abs(center_y_ - y), 1});
  for (int step = 0; step < steps; ++step) {
    const int column = x + (center_x_ - x) * step / steps;
    const int row = y + (center_y_ - y) * step / steps;
    if (hasRay(column, row)) return ray(column, row);
  }
  return ray(center_x_, center_y_);
}

std::vector<bool> UndistortionTable::outsideLens() const {
  std::vector<bool> outside(rays_->size());
  std::transform(rays_->begin(), rays_->end(), outside.begin(),
                 [](const Eigen::Vector2f& ray) { return std::isnan(ray.x()); });
  if (std::find(outside.begin(), outside.end(), true) == outside.end()) outside.clear();
  return outside;
}

}  // namespace efm
