// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <functional>
#include <vector>

#include "mapping/geometry/rigid3.h"

namespace efm {

/// A common mistake about poses or the rig.
enum class PoseMistake {
  kInverted,         ///< The poses are T_rig_world.
  kQuaternionOrder,  ///< qx qy qz qw were read from qw qx qy qz.
  kCamerasSwapped,   ///< The events of cameras 0 and 1 are exchanged.
  kStereoInverted,   ///< The transform between cameras 0 and 1 is inverted.
  kAxes,             ///< The axes of the tracked body are others than the rig's.
  kTimeShift,        ///< The clocks of events and poses differ.
  kUnknown,          ///< The poses do not explain the events; no other mistake would, either.
};

/// A mistake about each pose, and how to undo it.
struct PoseHypothesis {
  PoseMistake mistake = PoseMistake::kUnknown;
  std::function<Rigid3(const Rigid3&)> T_world_rig;          ///< Of a pose as it is.
  Eigen::Matrix3d R_body_rig = Eigen::Matrix3d::Identity();  ///< Of `kAxes`.
};

/// The simplest first. @return poses inverted, the other order of the quaternion, and all 23
/// rotations of the axes.
std::vector<PoseHypothesis> poseHypotheses();

}  // namespace efm
