// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Geometry>
#include <optional>
#include <vector>

#include "mapping/keyframes/fusion_mapper.h"
#include "mapping/survey/pose_hypotheses.h"
#include "mapping/survey/window_sample.h"

namespace efm {

/// A mistake that would explain why the events are not as sharp as they could be.
struct PoseFinding {
  PoseMistake mistake = PoseMistake::kUnknown;
  /// Without the mistake, the events are this many times as sharp.
  double gain = 1;
  /// Further mistakes that explain the events as well; each once.
  std::vector<PoseMistake> alternatives;
  /// `kAxes`: the poses are T_world_body, and T_world_rig = T_world_body * T_body_rig.
  Eigen::Matrix3d R_body_rig = Eigen::Matrix3d::Identity();
  double shift_s = 0;  ///< `kTimeShift`: to be added to the events' times.
};

/// Compares how sharp the events of samples are with the poses as they are, and with each mistake
/// undone. Sharp: many rays meet in few points; see `EventSharpness`. A single camera sees the
/// direction of the motion alone, and depths can make up for some mistakes: less is found.
/// @return nothing where the poses explain the events best, where no sample has parallax, and where
///   the rig hardly moves.
/// @throws std::invalid_argument where the options do not fit the rig.
std::optional<PoseFinding> checkPoses(const Rig& rig, const std::vector<WindowSample>& samples,
                                      const FusionMapperOptions& options);

}  // namespace efm
