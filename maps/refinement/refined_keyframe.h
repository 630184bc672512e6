// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>

#include "mapping/geometry/rigid3.h"
#include "maps/refinement/registration_cloud.h"
#include "maps/refinement/tracker_errors.h"

namespace efm {

/// A keyframe with a refined pose.
struct RefinedKeyframe {
  RegistrationCloud cloud;
  Rigid3 T_odom_ref;             ///< By the tracker; its world may drift.
  Rigid3 T_world_ref;            ///< Refined.
  Rigid3 T_world_ref_denoised;   ///< The pose of the tracker without noise, in the refined world.
  double path_length_m = 0;      ///< From the first keyframe, by the tracker.
  NoiseScale noise_scale = {};   ///< Of its pose by the tracker.
  std::size_t first_factor = 0;  ///< No factor before this index has the keyframe.
  bool moved = true;             ///< Since `takeMoved`.
};

}  // namespace efm
