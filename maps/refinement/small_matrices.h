// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>

namespace efm {

using Vector6d = Eigen::Matrix<double, 6, 1>;
using Matrix6d = Eigen::Matrix<double, 6, 6>;

// Decompositions of small symmetric matrices. They are compiled here once, because each takes the
// compiler seconds.

/// The lower triangular L with covariance = L L^T.
/// @param covariance positive definite.
Matrix6d choleskyFactor(const Matrix6d& covariance);

/// L^-1, where covariance = L L^T: it scales errors with this covariance to unit covariance.
/// @param covariance positive definite.
Matrix6d sqrtInformation(const Matrix6d& covariance);
Eigen::Matrix3d sqrtInformation(const Eigen::Matrix3d& covariance);

bool isPositiveDefinite(const Eigen::Matrix3d& matrix);

/// @param matrix not singular.
Matrix6d inverseOf(const Matrix6d& matrix);

/// matrix = vectors * diag(values) * vectors^T; values ascending.
struct EigenDecomposition {
  Vector6d values;
  Matrix6d vectors;
};
EigenDecomposition eigenDecomposition(const Matrix6d& matrix);

double maxEigenvalue(const Eigen::Matrix3d& matrix);

}  // namespace efm
