// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Geometry>
#include <cstdint>

#include "mapping/geometry/rigid3.h"
#include "mapping/geometry/trajectory.h"

namespace efm {

/// The motion of one camera in the reference view during one segment of the trajectory. Terms that
/// do not depend on time are computed once, because a segment is asked for thousands of poses.
///
/// Slerp commutes with fixed rotations on both sides, so it runs between the camera's own
/// rotations. The camera's position is that of the rig, which moves on a line, plus the rotated
/// lever arm.
class CameraMotion {
 public:
  CameraMotion(const TrajectorySegment& segment, const Rigid3& T_ref_world,
               const Rigid3& T_rig_cam);

  /// T_ref_cam = T_ref_world * segment.poseAt(t_ns) * T_rig_cam up to rounding. `t_ns` lies inside
  /// the segment.
  Rigid3 poseAt(std::int64_t t_ns) const;

 private:
  std::int64_t first_ns_;
  double per_ns_ = 0;  // 1 / length of the segment; 0 for the segment of a single pose
  Eigen::Quaterniond R_ref_cam0_;
  Eigen::Quaterniond R_ref_cam1_;  // its sign is the one nearer to R_ref_cam0_
  double angle_ = 0;               // between the two unit quaternions: half the rotation angle
  double sine_ = 0;                // of `angle_`; 0 where it is too small to divide by
  Eigen::Vector3d rig0_ref_;       // position of the rig at the first pose
  Eigen::Vector3d step_ref_;       // from there to the rig's position at the last pose
  Eigen::Vector3d lever_cam_;      // from the rig to the camera
};

}  // namespace efm
