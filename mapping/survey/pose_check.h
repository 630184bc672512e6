// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

#include <functional>
#include <optional>
#include <string>
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
  kCameraClock,      ///< The clock of one camera differs from that of camera 0.
  kMirrored,         ///< The events' columns or rows are mirrored, or exchanged.
  kPixels,           ///< The events' pixels are not those of the calibration: cropped or binned.
  kUnknown,          ///< The poses do not explain the events, and it is not known why.
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

/// Pixels of the calibration for pixels of the events.
struct PixelChange {
  bool exchange = false;  ///< Columns are rows, before the mirror.
  bool mirror_x = false;
  bool mirror_y = false;
  bool binned = false;                       ///< Two by two pixels are one pixel.
  std::vector<Eigen::Vector2i> offset_px{};  ///< To be added, of each camera; empty: none.

  /// @param camera index of the camera in the rig.
  Eigen::Vector2i operator()(Eigen::Vector2i pixel, const CameraModel& model,
                             std::size_t camera) const;
};

/// A mistake that would explain why the events are not as sharp as they could be.
struct PoseFinding {
  PoseMistake mistake = PoseMistake::kUnknown;
  /// Without the mistake, the events are this many times as sharp.
  double gain = 1;
  /// All mistakes that explain the events equally well, if there are several, without duplicates.
  std::vector<PoseMistake> alternatives{};
  /// `kAxes`: the poses are T_world_body, and T_world_rig = T_world_body * T_body_rig.
  Eigen::Matrix3d R_body_rig = Eigen::Matrix3d::Identity();
  double shift_s = 0;  ///< `kTimeShift`, `kCameraClock`: seconds to add to the events' times.
  std::optional<std::size_t> camera{};  ///< The only camera with the mistake.
  /// `kMirrored`, `kPixels`: the cure. `kPixels` without a cure: the events leave a side of a
  /// sensor empty, and neither the poses nor other pixels explain them.
  PixelChange pixels{};
};

struct PoseJudgement {
  std::optional<PoseFinding> finding;
  /// Without a finding: what could not be checked, and why; empty if the poses are right.
  std::string unchecked{};
  /// Sharpness of the events with the poses as they are, relative to the sharpest alternative that
  /// was tried: other axes, an inverse, or clocks at least 5 ms apart. std::nullopt if none was
  /// compared.
  std::optional<double> sharpness{};
};

/// Compares the sharpness of the samples' events with the poses as they are, and with each mistake
/// undone. Events are sharp if many rays meet in few points; see `EventSharpness`. A mistake is
/// chosen on one half of the data and verified on the other half, and no other mistake may explain
/// the events as well. A single camera needs more time: depths hide mistakes about its motion.
/// Where the poses are clearly right, most axes, far clocks and mirrored pictures are not tried.
PoseJudgement checkPoses(const Rig& rig, const std::vector<WindowSample>& samples,
                         const FusionMapperOptions& options);

}  // namespace efm
