// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/mrpt/tracker_poses.h"

#include <mrpt/obs/CObservationRobotPose.h>

#include "mapping/geometry/timestamp.h"
#include "plugin/mrpt/mrpt_pose.h"

namespace efm {

Rigid3 rigPose(const ObservedPose& observed, const std::optional<Rigid3>& T_body_rig) {
  return observed.T_world_body * T_body_rig.value_or(observed.T_body_rig);
}

void TrackerPoses::add(const mrpt::obs::CObservation& observation, const ObservedPose& observed,
                       const Rigid3& T_world_rig) {
  const auto [at, is_new] = newest_.try_emplace(*poseSourceOf(observation));
  Newest& newest = at->second;
  // One that is much older than the newest says that its time was wrong, or the clock went back.
  if (!is_new && observed.t_ns < newest.t_ns &&
      newest.t_ns - observed.t_ns <= kNanosecondsPerSecond) {
    return;
  }
  newest.t_ns = observed.t_ns;
  newest.pose = {};
  if (const auto* robot = dynamic_cast<const mrpt::obs::CObservationRobotPose*>(&observation)) {
    // MRPT moves the covariance from the body to the rig.
    newest.pose = robot->pose;
    newest.pose += mrptPoseFrom(observed.T_world_body.inverse() * T_world_rig);
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
