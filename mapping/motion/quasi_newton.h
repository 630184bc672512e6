// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <functional>

namespace efm {

/// Minimum of a smooth function by the method of Broyden, Fletcher, Goldfarb and Shanno, with a
/// line search that halves its steps (Nocedal and Wright, Numerical Optimization, 2006, Alg. 6.1).
/// For few variables of about the same scale.
struct QuasiNewtonOptions {
  int max_evaluations = 60;
  double first_step = 0.1;  ///< Length of the first trial step, in the variables' unit.
  double min_step = 1e-4;   ///< A shorter step ends the search.
};

/// @param function returns its value at a position and sets the gradient; infinite outside its
/// domain.
/// @return the best position found; never worse than the start.
Eigen::VectorXd minimise(
    const std::function<double(const Eigen::VectorXd&, Eigen::VectorXd&)>& function,
    const Eigen::VectorXd& start, const QuasiNewtonOptions& options = {});

}  // namespace efm
