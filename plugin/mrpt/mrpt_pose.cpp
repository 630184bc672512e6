// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/mrpt/mrpt_pose.h"

#include <mrpt/poses/CPose3D.h>
#include <mrpt/poses/CPose3DPDFGaussian.h>
#include <mrpt/poses/CPose3DQuat.h>
#include <mrpt/poses/CPose3DQuatPDFGaussian.h>

namespace efm {

Rigid3 rigidFrom(const mrpt::poses::CPose3D& pose) {
  // From the matrix: getAsQuaternion uses the angles and loses up to half of the digits near a
  // pitch of 90 degrees.
  const Eigen::Matrix3d rotation = pose.getRotationMatrix().asEigen();
  return {Eigen::Quaterniond(rotation).normalized(), {pose.x(), pose.y(), pose.z()}};
}

namespace {

mrpt::poses::CPose3DQuat quaternionPoseFrom(const Rigid3& T_a_b) {
  Eigen::Quaterniond rotation = T_a_b.rotation.normalized();
  if (rotation.w() < 0) rotation.coeffs() *= -1;  // MRPT's form: r >= 0
  const mrpt::math::CQuaternionDouble q(rotation.w(), rotation.x(), rotation.y(), rotation.z());
  const Eigen::Vector3d& t = T_a_b.translation;
  return {t.x(), t.y(), t.z(), q};
}

}  // namespace

mrpt::poses::CPose3D mrptPoseFrom(const Rigid3& T_a_b) {
  return mrpt::poses::CPose3D(quaternionPoseFrom(T_a_b));
}

mrpt::poses::CPose3DPDFGaussian mrptPoseFrom(const Rigid3& T_a_b, const Matrix6d& covariance) {
  mrpt::poses::CPose3DQuatPDFGaussian with_quaternion;
  with_quaternion.mean = quaternionPoseFrom(T_a_b);
  // A small rotation vector v about the axes of a makes q to (1, v / 2) q.
  const auto& q = with_quaternion.mean.quat();
  Eigen::Matrix<double, 7, 6> by_motion = Eigen::Matrix<double, 7, 6>::Zero();
  by_motion.topLeftCorner<3, 3>().setIdentity();
  by_motion.bottomRightCorner<4, 3>() << -q.x(), -q.y(), -q.z(),  //
      q.r(), q.z(), -q.y(),                                       //
      -q.z(), q.r(), q.x(),                                       //
      q.y(), -q.x(), q.r();
  by_motion.bottomRightCorner<4, 3>() *= 0.5;
  with_quaternion.cov =
      mrpt::math::CMatrixDouble77((by_motion * covariance * by_motion.transpose()).eval());
  return mrpt::poses::CPose3DPDFGaussian(with_quaternion);
}

}  // namespace efm
