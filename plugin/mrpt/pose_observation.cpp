// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/mrpt/pose_observation.h"

#include <mrpt/obs/CObservationOdometry.h>
#include <mrpt/obs/CObservationRobotPose.h>

#include <cmath>
#include <stdexcept>

#include "mapping/base/text.h"
#include "plugin/mrpt/dead_reckoning.h"
#include "plugin/mrpt/mrpt_pose.h"
#include "plugin/mrpt/mrpt_time.h"

namespace efm {

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

std::optional<ObservedPose> poseIn(const mrpt::obs::CObservation& observation) {
  const auto* robot = dynamic_cast<const CObservationRobotPose*>(&observation);
  const auto* odometry = dynamic_cast<const CObservationOdometry*>(&observation);
  if (robot == nullptr && odometry == nullptr) return std::nullopt;
  if (observation.timestamp == INVALID_TIMESTAMP) {
    throw std::invalid_argument("a pose of " + inQuotes(observation.sensorLabel) +
                                " has no time stamp: every pose must have one");
  }
  const std::int64_t t_ns = nanosecondsFrom(observation.timestamp);
  if (robot == nullptr) {
    return ObservedPose{t_ns, rigidFrom(mrpt::poses::CPose3D(odometry->odometry)), {}};
  }
  return ObservedPose{t_ns, rigidFrom(robot->pose.mean), rigidFrom(robot->sensorPose).inverse(),
                      noiseOf(robot->pose)};
}

mrpt::obs::CObservation::Ptr poseObservation(const ObservedPose& pose, const std::string& label) {
  auto observation = CObservationRobotPose::Create();
  observation->sensorLabel = label;
  observation->timestamp = mrptTimeFrom(pose.t_ns);
  observation->pose.mean = mrptPoseFrom(pose.T_world_body);
  observation->sensorPose = mrptPoseFrom(pose.T_body_rig.inverse());
  return observation;
}

void setBodyToRig(mrpt::obs::CObservation& pose, const Rigid3& T_body_rig) {
  pose.setSensorPose(mrptPoseFrom(T_body_rig.inverse()));
}

}  // namespace efm
