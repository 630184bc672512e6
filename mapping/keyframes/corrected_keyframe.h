// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>

#include "mapping/events/window_input.h"
#include "mapping/geometry/trajectory.h"
#include "mapping/keyframes/keyframe_depth_map.h"
#include "mapping/keyframes/stage.h"
#include "mapping/motion/motion_correction.h"

namespace efm {

/// Maps a window along a motion.
using MapAlong = std::function<KeyframeDepthMap(const Trajectory& motion)>;

/// Maps a window along the tracker's motion, then finds the correction of the motion from the
/// depth, and maps again along the corrected motion, as long as the fused DSI becomes sharper.
/// @return the sharpest keyframe, with its correction if there is one.
KeyframeDepthMap mapCorrected(const WindowInput& input, const Trajectory& tracked,
                              const MapAlong& map_along, const MotionCorrectionOptions& options,
                              StageHook* stages);

}  // namespace efm
