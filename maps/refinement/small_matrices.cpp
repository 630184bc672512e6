// SPDX-License-Identifier: BSD-3-Clause
#include "maps/refinement/small_matrices.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <cmath>

namespace efm {
namespace {

/// The Cholesky factor of a 3 x 3 matrix. Its diagonal has a value that is not above 0, or none,
/// where the matrix is not positive definite.
Eigen::Matrix3d factorOf(const Eigen::Matrix3d& a) {
  Eigen::Matrix3d l = Eigen::Matrix3d::Zero();
  l(0, 0) = std::sqrt(a(0, 0));
  l(1, 0) = a(1, 0) / l(0, 0);
  l(2, 0) = a(2, 0) / l(0, 0);
  l(1, 1) = std::sqrt(a(1, 1) - l(1, 0) * l(1, 0));
  l(2, 1) = (a(2, 1) - l(2, 0) * l(1, 0)) / l(1, 1);
  l(2, 2) = std::sqrt(a(2, 2) - (l(2, 0) * l(2, 0) + l(2, 1) * l(2, 1)));
  return l;
}

}  // namespace

Matrix6d choleskyFactor(const Matrix6d& covariance) { return covariance.llt().matrixL(); }

Matrix6d sqrtInformation(const Matrix6d& covariance) {
  return covariance.llt().matrixL().solve(Matrix6d::Identity());
}

Eigen::Matrix3d sqrtInformation(const Eigen::Matrix3d& covariance) {
  const Eigen::Matrix3d l = factorOf(covariance);
  Eigen::Matrix3d inverse = Eigen::Matrix3d::Identity();
  for (int column = 0; column < 3; ++column) {  // forward substitution
    for (int row = column; row < 3; ++row) {
      inverse(row, column) *= 1 / l(row, row);
      for (int below = row + 1; below < 3; ++below) {
        inverse(below, column) -= inverse(row, column) * l(below, row);
      }
    }
  }
  return inverse;
}

bool isPositiveDefinite(const Eigen::Matrix3d& matrix) {
  return (factorOf(matrix).diagonal().array() > 0).all();
}

Matrix6d inverseOf(const Matrix6d& matrix) { return matrix.inverse(); }

EigenDecomposition eigenDecomposition(const Matrix6d& matrix) {
  const Eigen::SelfAdjointEigenSolver<Matrix6d> solver(matrix);
  return {solver.eigenvalues(), solver.eigenvectors()};
}

double maxEigenvalue(const Eigen::Matrix3d& matrix) {
  return Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(matrix).eigenvalues().maxCoeff();
}

}  // namespace efm
