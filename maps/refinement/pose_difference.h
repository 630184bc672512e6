// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>

#include "mapping/geometry/rigid3.h"

namespace efm {

/// How two poses differ, or a small motion: translation in metres, then a rotation vector (axis
/// times angle) in radians. Covariances and informations of poses have the same order.
using Vector6d = Eigen::Matrix<double, 6, 1>;
using Matrix6d = Eigen::Matrix<double, 6, 6>;

/// The motion T_a_b as six numbers: where b stands in a, and its rotation vector, of at most pi.
Vector6d differenceOf(const Rigid3& T_a_b);

/// The inverse of `differenceOf`.
Rigid3 rigidFromDifference(const Vector6d& difference);

/// A matrix L^-1 with covariance = L L^T: what makes errors of that covariance to unit ones.
Matrix6d sqrtInformation(const Matrix6d& covariance);

}  // namespace efm
