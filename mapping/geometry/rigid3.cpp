// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/geometry/rigid3.h"

#include <Eigen/LU>
#include <Eigen/SVD>

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "mapping/base/text.h"

namespace efm {

Vector6d differenceOf(const Rigid3& T_a_b) {
  const Eigen::AngleAxisd rotation(T_a_b.rotation);  // 0 to pi, for either sign of the quaternion
  Vector6d difference;
  difference << T_a_b.translation, rotation.angle() * rotation.axis();
  return difference;
}

double distanceBetween(const Rigid3& a, const Rigid3& b) {
  return (a.translation - b.translation).norm() + a.rotation.angularDistance(b.rotation);
}

Rigid3 rigidFromDifference(const Vector6d& difference) {
  return {rotationBy(difference.tail<3>()), difference.head<3>()};
}

std::optional<Eigen::Quaterniond> rotationNear(const Eigen::Matrix3d& R_a_b) {
  constexpr double kMaxError = 1e-3;
  const double error =
      (R_a_b * R_a_b.transpose() - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff();
  if (!R_a_b.allFinite() || error > kMaxError || R_a_b.determinant() < 0) return std::nullopt;
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(R_a_b, Eigen::ComputeFullU | Eigen::ComputeFullV);
  const Eigen::Matrix3d nearest = svd.matrixU() * svd.matrixV().transpose();
  return Eigen::Quaterniond(nearest).normalized();
}

std::optional<Rigid3> transformNear(const Eigen::Matrix4d& T_a_b) {
  constexpr double kMaxError = 1e-3;
  const double error = (T_a_b.row(3) - Eigen::RowVector4d(0, 0, 0, 1)).cwiseAbs().maxCoeff();
  if (!T_a_b.allFinite() || error > kMaxError) return std::nullopt;
  const auto rotation = rotationNear(Eigen::Matrix3d(T_a_b.topLeftCorner<3, 3>()));
  if (!rotation) return std::nullopt;
  return Rigid3{*rotation, T_a_b.topRightCorner<3, 1>()};
}

std::optional<Eigen::Quaterniond> rotationNear(const Eigen::Quaterniond& rotation) {
  constexpr double kMaxError = 0.01;
  const double length = rotation.coeffs().stableNorm();
  if (!(std::abs(length - 1) <= kMaxError)) return std::nullopt;
  return Eigen::Quaterniond(rotation.coeffs() / length);
}

Rigid3 transformOf(const double* numbers, std::size_t count) {
  NumberText error(6);
  const double* const end = numbers + count;
  const double* const wrong =
      std::find_if_not(numbers, end, [](double n) { return std::isfinite(n); });
  if (wrong != end) {
    error << (count == 16           ? "matrix"
              : wrong < numbers + 3 ? "position"
                                    : "orientation")
          << " = " << *wrong << ": expected a finite number";
  } else if (count == 16) {
    const Eigen::Map<const Eigen::Matrix<double, 4, 4, Eigen::RowMajor>> matrix(numbers);
    if (const auto T_a_b = transformNear(matrix)) return *T_a_b;
    error << "a 4x4 matrix: expected a rotation and a last row 0 0 0 1, both to 0.001";
  } else if (count == 7) {
    const Eigen::Quaterniond quaternion(numbers[6], numbers[3], numbers[4], numbers[5]);
    if (const auto rotation = rotationNear(quaternion))
      return {*rotation, {numbers[0], numbers[1], numbers[2]}};
    error << "qx qy qz qw of length " << quaternion.coeffs().stableNorm()
          << ": expected a rotation, of length 1 within 1 %";
  } else {
    error << count << " numbers: expected 7, a position and a quaternion, or 16, a matrix";
  }
  throw std::runtime_error(error.str());
}

}  // namespace efm
