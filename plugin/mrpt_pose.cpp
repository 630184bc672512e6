// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/mrpt_pose.h"

#include <mrpt/poses/CPose3D.h>
#include <mrpt/poses/CPose3DQuat.h>

namespace efm {

Rigid3 rigidFrom(const mrpt::poses::CPose3D& pose) {
  // From the matrix: getAsQuaternion goes through the angles, which near a pitch of 90 degrees
  // loses up to half of the digits.
  const Eigen::Matrix3d rotation = pose.getRotationMatrix().asEigen();
  return {Eigen::Quaterniond(rotation).normalized(), {pose.x(), pose.y(), pose.z()}};
}

mrpt::poses::CPose3D mrptPoseFrom(const Rigid3& T_a_b) {
  Eigen::Quaterniond rotation = T_a_b.rotation.normalized();
  if (rotation.w() < 0) rotation.coeffs() *= -1;  // MRPT's form: r >= 0
  const mrpt::math::CQuaternionDouble q(rotation.w(), rotation.x(), rotation.y(), rotation.z());
  const Eigen::Vector3d& t = T_a_b.translation;
  return mrpt::poses::CPose3D(mrpt::poses::CPose3DQuat(t.x(), t.y(), t.z(), q));
}

}  // namespace efm
