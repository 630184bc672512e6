// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

#include <functional>
#include <optional>
#include <vector>

#include "mapping/geometry/rigid3.h"
#include "mapping/keyframes/fusion_mapper.h"
#include "mapping/survey/scene_depths.h"

namespace efm {

/// A common mistake about poses or the rig.
enum class PoseMistake {
  kInverted,         ///< The poses are T_rig_world.
  kQuaternionOrder,  ///< qx qy qz qw were read from qw qx qy qz.
  kCamerasSwapped,   ///< The events of cameras 0 and 1 are exchanged.
  kStereoInverted,   ///< The transform between cameras 0 and 1 is inverted.
  kAxes,             ///< The tracked body has other axes than the rig.
  kTimeShift,        ///< The clocks of events and poses differ.
  kUnknown,          ///< The poses do not explain the events, and no other mistake does.
};

/// A mistake about each pose, and how to undo it.
struct PoseHypothesis {
  PoseMistake mistake = PoseMistake::kUnknown;
  std::function<Rigid3(const Rigid3&)> T_world_rig;          ///< Corrects a pose.
  Eigen::Matrix3d R_body_rig = Eigen::Matrix3d::Identity();  ///< The rotation of `kAxes`.
};

/// Returns the mistakes, the simplest first: inverted poses, the other order of the quaternion, and
/// all 23 rotations of the axes.
std::vector<PoseHypothesis> poseHypotheses();

/// A mistake that would explain why the events are not as sharp as they could be.
struct PoseFinding {
  PoseMistake mistake = PoseMistake::kUnknown;
  /// Without the mistake, the events are this many times as sharp.
  double gain = 1;
  /// Other mistakes that explain the events equally well, without duplicates.
  std::vector<PoseMistake> alternatives;
  /// `kAxes`: the poses are T_world_body, and T_world_rig = T_world_body * T_body_rig.
  Eigen::Matrix3d R_body_rig = Eigen::Matrix3d::Identity();
  double shift_s = 0;  ///< `kTimeShift`: seconds to add to the events' times.
};

/// Compares the sharpness of the samples' events with the poses as they are, and with each mistake
/// undone. Events are sharp if many rays meet in few points; see `EventSharpness`. A single camera
/// finds fewer mistakes: it sees only the direction of the motion, and depths may hide mistakes.
/// @return std::nullopt if the poses explain the events best, if no sample has parallax, or if the
///   rig hardly moves.
std::optional<PoseFinding> checkPoses(const Rig& rig, const std::vector<WindowSample>& samples,
                                      const FusionMapperOptions& options);

}  // namespace efm
