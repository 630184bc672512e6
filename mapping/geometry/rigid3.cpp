// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/geometry/rigid3.h"

#include <Eigen/LU>
#include <Eigen/SVD>

#include <cmath>

namespace efm {

Vector6d differenceOf(const Rigid3& T_a_b) {
  const Eigen::AngleAxisd rotation(T_a_b.rotation);  // 0 to pi, for either sign of the quaternion
  Vector6d difference;
  difference << T_a_b.translation, rotation.angle() * rotation.axis();
  return difference;
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

}  // namespace efm
