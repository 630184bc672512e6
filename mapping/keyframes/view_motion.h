// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <vector>

#include "mapping/events/window_data.h"
#include "mapping/geometry/rig.h"
#include "mapping/keyframes/keyframe_mapper.h"

namespace efm {

/// How far the selected cameras are from the reference view within a window: maxima.
struct ViewMotion {
  double rig_baseline_m = 0;  ///< Of any camera at the reference time.
  double shift_m = 0;         ///< Of the reference camera, at any time.
  double rotation_rad = 0;    ///< Of the reference camera.
  /// The parallax of inverse depth, for any camera at any time, averaged over the view: pixels per
  /// 1/m.
  double parallax_px_m = 0;
};

/// @param cameras the selected ones, as indices of the rig.
/// @return nothing where the window's reference time has no pose.
std::optional<ViewMotion> motionIn(const WindowData& data, const Rig& rig,
                                   const std::vector<int>& cameras,
                                   const KeyframeMapperOptions& options);

}  // namespace efm
