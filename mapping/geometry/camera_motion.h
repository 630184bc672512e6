// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Geometry>
#include <cstdint>

#include "mapping/geometry/rigid3.h"
#include "mapping/geometry/trajectory.h"

namespace efm {

/// The motion of one camera in the reference view during one segment of the trajectory. What does
/// not change with time is computed once: poses are asked for by the thousand.
///
/// Slerp commutes with the fixed rotations on both sides, so it runs between the camera's own
/// rotations. Its position is the rig's, which moves on a line, and the rotated lever from there.
class CameraMotion {
 public:
  CameraMotion(const TrajectorySegment& segment, const Rigid3& T_ref_world,
               const Rigid3& T_rig_cam);

  /// T_ref_cam = T_ref_world * segment.poseAt(t_ns) * T_rig_cam but for rounding, at a time inside
  /// the segment.
  Rigid3 poseAt(std::int64_t t_ns) const;

 private:
  std::int64_t first_ns_;
  double per_ns_ = 0;  // 1 / length of the segment; 0 where a single pose stands alone
  Eigen::Quaterniond R_ref_cam0_;
  Eigen::Quaterniond R_ref_cam1_;  // of the two signs the one nearer to the first
  double angle_ = 0;               // between them as unit vectors: half the turn
  double sine_ = 0;                // of that angle; 0 where it is too small to divide by
  Eigen::Vector3d rig0_ref_;       // where the rig is at first
  Eigen::Vector3d step_ref_;       // and how far it moves until the last pose
  Eigen::Vector3d lever_cam_;      // from the rig to the camera
};

}  // namespace efm
