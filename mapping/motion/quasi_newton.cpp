// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/motion/quasi_newton.h"

#include <cmath>

namespace efm {

Eigen::VectorXd minimise(
    const std::function<double(const Eigen::VectorXd&, Eigen::VectorXd&)>& function,
    const Eigen::VectorXd& start, const QuasiNewtonOptions& options) {
  const Eigen::Index size = start.size();
  Eigen::VectorXd place = start;
  Eigen::VectorXd slope(size);
  double value = function(place, slope);
  int left = options.max_evaluations - 1;
  if (!(std::isfinite(value) && slope.norm() > 0)) return place;
  Eigen::MatrixXd inverse_hessian =
      options.first_step / slope.norm() * Eigen::MatrixXd::Identity(size, size);

  while (left > 0) {
    Eigen::VectorXd step = -(inverse_hessian * slope);
    if (!(step.dot(slope) < 0)) break;
    Eigen::VectorXd next_slope(size);
    double next = value;
    for (; left > 0; step /= 2) {
      if (step.norm() < options.min_step) return place;
      constexpr double kArmijo = 1e-4;
      next = function(place + step, next_slope);
      --left;
      if (next <= value + kArmijo * step.dot(slope)) break;
    }
    if (!(next < value)) break;
    const Eigen::VectorXd change = next_slope - slope;
    place += step;
    value = next;
    slope = next_slope;
    const double curvature = step.dot(change);
    if (curvature <= 0) continue;  // not convex there: nothing is learned
    const Eigen::VectorXd turned = inverse_hessian * change;
    inverse_hessian -= (step * turned.transpose() + turned * step.transpose()) / curvature;
    inverse_hessian += (1 + change.dot(turned) / curvature) / curvature * step * step.transpose();
  }
  return place;
}

}  // namespace efm
