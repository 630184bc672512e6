// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/results/pictures/upward.h"

#include <cmath>

#include "mapping/geometry/rigid3.h"

namespace efm {

Eigen::Vector3d upwardOf(const std::vector<StampedPose>& trajectory) {
  constexpr int kSteps = 100;
  constexpr double kPull = 0.05;  // towards -y, which decides where the x axes do not
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  Eigen::Matrix3d across = Eigen::Matrix3d::Zero();
  for (const StampedPose& pose : trajectory) {
    const Eigen::Matrix3d R_world_ref = pose.T_world_rig.rotation.toRotationMatrix();
    mean -= R_world_ref.col(1);
    across += R_world_ref.col(0) * R_world_ref.col(0).transpose();
  }
  const auto count = static_cast<double>(trajectory.size());
  if (!(mean.norm() > 0.2 * count)) return Eigen::Vector3d::UnitZ();
  const Eigen::Vector3d guess = mean.normalized();
  across /= count;
  Eigen::Vector3d up = guess;
  for (int step = 0; step < kSteps; ++step) {  // power iteration: the largest eigenvalue
    up = (up + kPull * up.dot(guess) * guess - across * up).normalized();
  }
  if (up.dot(guess) < 0) up = -up;
  int axis = 0;
  if (up.cwiseAbs().maxCoeff(&axis) < std::cos(15 * kRadiansPerDegree)) return up;
  return std::copysign(1.0, up[axis]) * Eigen::Vector3d::Unit(axis);
}

}  // namespace efm
