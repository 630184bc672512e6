// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <mrpt/obs/CObservation.h>

#include <optional>
#include <string>

#include "maps/refinement/tracker_errors.h"
#include "plugin/session/pose_source_selector.h"

namespace efm {

/// A pose as an observation brings it.
struct ObservedPose {
  std::int64_t t_ns = 0;
  Rigid3 T_world_body;  ///< Of what was tracked.
  Rigid3 T_body_rig;    ///< As the observation says; the identity where it does not.
  /// What the tracker says of its noise: the size of its covariance, not its shape. None where that
  /// is zero or no covariance.
  std::optional<PoseNoise> noise = std::nullopt;
};

/// Who says a pose: a CObservationRobotPose (one that is labelled "actions" was composed from them)
/// or a CObservationOdometry. @return nothing where the observation is neither.
std::optional<PoseSourceId> poseSourceOf(const mrpt::obs::CObservation& observation);

/// What a pose's observation says: T_world_body is its pose, T_body_rig the inverse of its sensor's
/// pose on the robot; odometry is a pose in the plane z = 0, of which velocities do not matter.
/// @return nothing where it is none. @throws std::invalid_argument where it has no time.
std::optional<ObservedPose> poseIn(const mrpt::obs::CObservation& observation);

/// As a CObservationRobotPose. MRPT rounds its time to 100 ns: at 300 px/s, 1.5e-5 px.
mrpt::obs::CObservation::Ptr poseObservation(const ObservedPose& pose, const std::string& label);

/// Says where the rig is on the tracked body, in place of what a pose's observation says.
/// CObservationOdometry cannot hold it and stays as it is.
void setBodyToRig(mrpt::obs::CObservation& pose, const Rigid3& T_body_rig);

}  // namespace efm
