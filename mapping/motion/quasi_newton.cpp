// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/motion/quasi_newton.h"

#include <cmath>

namespace efm {

Eigen::VectorXd minimise(
    const std::function<double(const Eigen::VectorXd&, Eigen::VectorXd&)>& function,
    const Eigen::VectorXd& start, const QuasiNewtonOptions& options) {
  const Eigen::Index size = start.size();
  Eigen::VectorXd position = start;
  Eigen::VectorXd gradient(size);
  double value = function(position, gradient);
  int left = options.max_evaluations - 1;
  if (!(std::isfinite(value) && gradient.norm() > 0)) return position;
  Eigen::MatrixXd inverse_hessian =
      options.first_step / gradient.norm() * Eigen::MatrixXd::Identity(size, size);

  while (left > 0) {
    Eigen::VectorXd step = -(inverse_hessian * gradient);
    if (!(step.dot(gradient) < 0)) break;
    Eigen::VectorXd next_gradient(size);
    double next = value;
    for (; left > 0; step /= 2) {
      if (step.norm() < options.min_step) return position;
      constexpr double kArmijo = 1e-4;
      next = function(position + step, next_gradient);
      --left;
      if (next <= value + kArmijo * step.dot(gradient)) break;
    }
    if (!(next < value)) break;
    const Eigen::VectorXd change = next_gradient - gradient;
    position += step;
    value = next;
    gradient = next_gradient;
    const double curvature = step.dot(change);
    if (curvature <= 0) continue;  // not convex here: the step says nothing of the Hessian
    const Eigen::VectorXd scaled = inverse_hessian * change;
    inverse_hessian -= (step * scaled.transpose() + scaled * step.transpose()) / curvature;
    inverse_hessian += (1 + change.dot(scaled) / curvature) / curvature * step * step.transpose();
  }
  return position;
}

}  // namespace efm
