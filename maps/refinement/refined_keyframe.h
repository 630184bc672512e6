// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>

#include "mapping/geometry/rigid3.h"
#include "maps/refinement/registration_cloud.h"
#include "maps/refinement/tracker_errors.h"

namespace efm {

/// What is kept of a keyframe whose pose is refined.
struct RefinedKeyframe {
  RegistrationCloud cloud;
  Rigid3 T_odom_ref;               ///< As the tracker has it; its world may drift.
  Rigid3 T_world_ref;              ///< As it is by now.
  Rigid3 T_world_ref_denoised;     ///< Where the tracker would have put it without noise.
  double path_length_m = 0;        ///< From the first keyframe to here, by the tracker.
  PoseNoise noise = kCommonNoise;  ///< How many times the noise of others its pose has.
  std::size_t first_factor = 0;    ///< Of all factors: none before it has this keyframe.
  bool moved = true;               ///< Since somebody asked.
};

}  // namespace efm
