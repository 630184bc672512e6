// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/mrpt/pose_observation.h"

#include <mrpt/obs/CActionRobotMovement2D.h>
#include <mrpt/obs/CActionRobotMovement3D.h>
#include <mrpt/obs/CObservationOdometry.h>
#include <mrpt/obs/CObservationRobotPose.h>
#include <mrpt/poses/CPose3D.h>
#include <mrpt/poses/CPose3DQuat.h>
#include <mrpt/poses/CPose3DQuatPDFGaussian.h>

#include <cmath>

#include "mapping/base/text.h"
#include "mapping/geometry/timestamp.h"

namespace efm {

Rigid3 rigidFrom(const mrpt::poses::CPose3D& pose) {
  // The matrix is used because getAsQuaternion uses the angles and loses up to half of the digits
  // near a pitch of 90 degrees.
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
  // A small rotation vector v about the axes of frame a changes q to (1, v / 2) q.
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

using mrpt::obs::CObservationOdometry;
using mrpt::obs::CObservationRobotPose;

namespace {

std::optional<PoseNoise> noiseOf(const mrpt::poses::CPose3DPDFGaussian& pose) {
  const double variance_m2 = (pose.cov(0, 0) + pose.cov(1, 1) + pose.cov(2, 2)) / 3;
  const double variance_rad2 = (pose.cov(3, 3) + pose.cov(4, 4) + pose.cov(5, 5)) / 3;
  if (!(variance_m2 >= 0) || !(variance_rad2 >= 0) || !(variance_m2 + variance_rad2 > 0) ||
      !std::isfinite(variance_m2 + variance_rad2)) {
    return std::nullopt;
  }
  return PoseNoise{std::sqrt(variance_m2), std::sqrt(variance_rad2)};
}

}  // namespace

std::optional<PoseSourceId> poseSourceOf(const mrpt::obs::CObservation& observation) {
  const std::string& label = observation.sensorLabel;
  if (dynamic_cast<const CObservationRobotPose*>(&observation) != nullptr) {
    return PoseSourceId{label == kActionsLabel ? PoseKind::kActions : PoseKind::kPose, label};
  }
  if (dynamic_cast<const CObservationOdometry*>(&observation) != nullptr) {
    return PoseSourceId{PoseKind::kOdometry, label};
  }
  return std::nullopt;
}

std::optional<PoseSample> poseIn(const mrpt::obs::CObservation& observation) {
  const auto* robot = dynamic_cast<const CObservationRobotPose*>(&observation);
  const auto* odometry = dynamic_cast<const CObservationOdometry*>(&observation);
  if (robot == nullptr && odometry == nullptr) return std::nullopt;
  if (observation.timestamp == INVALID_TIMESTAMP) {
    throw std::invalid_argument("a pose of " + inQuotes(observation.sensorLabel) +
                                " has no time stamp: every pose must have one");
  }
  const std::int64_t t_ns = nanosecondsFrom(observation.timestamp);
  if (robot == nullptr) {
    return PoseSample{*poseSourceOf(observation),
                      t_ns,
                      roundedPose(rigidFrom(mrpt::poses::CPose3D(odometry->odometry))),
                      {}};
  }
  return PoseSample{*poseSourceOf(observation), t_ns, roundedPose(rigidFrom(robot->pose.mean)),
                    roundedMount(rigidFrom(robot->sensorPose).inverse()), noiseOf(robot->pose)};
}

mrpt::obs::CObservation::Ptr poseObservation(const PoseSample& pose) {
  auto observation = CObservationRobotPose::Create();
  observation->sensorLabel = pose.source.label;
  observation->timestamp = mrptTimeFrom(pose.t_ns);
  observation->pose.mean = mrptPoseFrom(pose.T_world_body);
  observation->sensorPose = mrptPoseFrom(pose.T_body_rig.inverse());
  return observation;
}

namespace {

using mrpt::obs::CActionRobotMovement2D;
using mrpt::obs::CActionRobotMovement3D;

struct Movement {
  mrpt::Clock::time_point time;
  Rigid3 T_before_after;
};

std::optional<Movement> movementIn(const mrpt::obs::CActionCollection& actions) {
  for (const auto& action : actions) {
    const mrpt::obs::CAction* one = action.get_ptr().get();
    if (const auto* planar = dynamic_cast<const CActionRobotMovement2D*>(one)) {
      if (!planar->poseChange) continue;
      const mrpt::poses::CPose3D change(planar->poseChange->getMeanVal());
      return Movement{planar->timestamp, rigidFrom(change)};
    }
    if (const auto* spatial = dynamic_cast<const CActionRobotMovement3D*>(one)) {
      return Movement{spatial->timestamp, rigidFrom(spatial->poseChange.mean)};
    }
  }
  return std::nullopt;
}

mrpt::Clock::time_point timeOf(const mrpt::obs::CSensoryFrame& frame) {
  for (const auto& observation : frame) {
    if (observation->timestamp != INVALID_TIMESTAMP) return observation->timestamp;
  }
  throw std::invalid_argument(
      "a movement has no time stamp: expected one in the action or in its sensory frame");
}

}  // namespace

mrpt::obs::CObservation::Ptr DeadReckoning::poseAfter(const mrpt::obs::CActionCollection& action,
                                                      const mrpt::obs::CSensoryFrame& frame) {
  const std::optional<Movement> movement = movementIn(action);
  if (!movement) return nullptr;
  const bool timed = movement->time != INVALID_TIMESTAMP;
  const std::int64_t t_ns = nanosecondsFrom(timed ? movement->time : timeOf(frame));
  T_world_body_ = T_world_body_ * movement->T_before_after;
  return poseObservation({{PoseKind::kActions, kActionsLabel}, t_ns, T_world_body_, {}});
}

void TrackerPoses::add(const mrpt::obs::CObservation& observation, const PoseSample& pose) {
  const Rigid3 T_world_rig = pose.T_world_rig();
  const auto [at, is_new] = newest_.try_emplace(pose.source);
  Newest& newest = at->second;
  // If a pose is over 1 s older, the newest time was wrong, or the clock was reset.
  if (!is_new && pose.t_ns < newest.t_ns && newest.t_ns - pose.t_ns <= kNanosecondsPerSecond) {
    return;
  }
  newest.t_ns = pose.t_ns;
  newest.pose = {};
  if (const auto* robot = dynamic_cast<const mrpt::obs::CObservationRobotPose*>(&observation)) {
    // MRPT moves the covariance from the body to the rig.
    newest.pose = robot->pose;
    newest.pose += mrptPoseFrom(pose.T_world_body.inverse() * T_world_rig);
  }
  newest.pose.mean = mrptPoseFrom(T_world_rig);
}

const mrpt::poses::CPose3DPDFGaussian* TrackerPoses::newest(
    const std::optional<PoseSourceId>& selected) const {
  const auto at = selected ? newest_.find(*selected) : newest_.begin();
  if (at == newest_.end() || (!selected && at->first.kind != PoseKind::kPose)) return nullptr;
  return &at->second.pose;
}

}  // namespace efm
