// SPDX-License-Identifier: BSD-3-Clause
#include "maps/refinement/pose_difference.h"

#include <Eigen/Cholesky>
#include <Eigen/Geometry>

namespace efm {

Vector6d differenceOf(const Rigid3& T_a_b) {
  const Eigen::AngleAxisd turn(T_a_b.rotation);  // 0 to pi, whatever the quaternion's sign
  Vector6d difference;
  difference << T_a_b.translation, turn.angle() * turn.axis();
  return difference;
}

Rigid3 rigidFromDifference(const Vector6d& difference) {
  const Eigen::Vector3d turn = difference.tail<3>();
  const double angle = turn.norm();
  Rigid3 T_a_b;
  T_a_b.translation = difference.head<3>();
  if (angle > 0) T_a_b.rotation = Eigen::Quaterniond(Eigen::AngleAxisd(angle, turn / angle));
  return T_a_b;
}

Matrix6d sqrtInformation(const Matrix6d& covariance) {
  return covariance.llt().matrixL().solve(Matrix6d::Identity());
}

}  // namespace efm
