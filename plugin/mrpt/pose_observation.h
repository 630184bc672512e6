// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <mrpt/obs/CObservation.h>

#include <optional>
#include <string>

#include "maps/refinement/tracker_model.h"
#include "plugin/session/pose_source_selector.h"

namespace efm {

/// The pose of an observation.
struct ObservedPose {
  std::int64_t t_ns = 0;
  Rigid3 T_world_body;  ///< Of the tracked body.
  Rigid3 T_body_rig;    ///< The identity if the observation does not have it.
  /// The mean standard deviations of the tracker's covariance. None if the covariance is zero or
  /// not valid.
  std::optional<PoseNoise> noise = std::nullopt;
};

/// The source of a pose: a CObservationRobotPose (with the label "actions": composed from actions)
/// or a CObservationOdometry. @return nothing for other observations.
std::optional<PoseSourceId> poseSourceOf(const mrpt::obs::CObservation& observation);

/// The pose of an observation: T_world_body is its pose, T_body_rig the inverse of its sensor's
/// pose on the robot. Odometry is a pose in the plane z = 0.
/// @return nothing for other observations. @throws std::invalid_argument if it has no time.
std::optional<ObservedPose> poseIn(const mrpt::obs::CObservation& observation);

/// Makes a CObservationRobotPose. MRPT rounds its time to 100 ns: 1.5e-5 px at 300 px/s.
mrpt::obs::CObservation::Ptr poseObservation(const ObservedPose& pose, const std::string& label);

/// Replaces the pose of the rig on the tracked body. CObservationOdometry has none and stays as it
/// is.
void setBodyToRig(mrpt::obs::CObservation& pose, const Rigid3& T_body_rig);

}  // namespace efm
