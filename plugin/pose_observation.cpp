// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/pose_observation.h"

#include <mrpt/obs/CObservationRobotPose.h>

#include <stdexcept>

#include "plugin/mrpt_pose.h"
#include "plugin/mrpt_time.h"

namespace efm {

using mrpt::obs::CObservationRobotPose;

bool isPose(const mrpt::obs::CObservation& observation) {
  return dynamic_cast<const CObservationRobotPose*>(&observation) != nullptr;
}

std::optional<ObservedPose> poseIn(const mrpt::obs::CObservation& observation) {
  const auto* robot = dynamic_cast<const CObservationRobotPose*>(&observation);
  if (robot == nullptr) return std::nullopt;
  if (robot->timestamp == INVALID_TIMESTAMP) {
    throw std::invalid_argument("a pose of '" + robot->sensorLabel +
                                "' has no time stamp: every pose must have one");
  }
  return ObservedPose{nanosecondsFrom(robot->timestamp), rigidFrom(robot->pose.mean),
                      rigidFrom(robot->sensorPose).inverse()};
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
