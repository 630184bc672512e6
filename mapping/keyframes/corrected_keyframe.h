// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>

#include "mapping/events/window_input.h"
#include "mapping/geometry/trajectory.h"
#include "mapping/keyframes/keyframe_depth_map.h"
#include "mapping/keyframes/stage.h"
#include "mapping/motion/motion_correction.h"
#include "mapping/sweep/space_sweep.h"

namespace efm {

/// A window that is mapped with correction of its motion. Owns nothing.
struct CorrectedWindow {
  const WindowInput& input;
  const Trajectory& tracked;
  const MotionCorrectionOptions& options;
  DsiSink* sink = nullptr;      ///< May be null; receives the DSI of the result alone.
  StageHook* stages = nullptr;  ///< May be null.
};

/// Maps the window along a motion; the sink may be null.
using MapAlong = std::function<KeyframeDepthMap(const Trajectory& motion, DsiSink* sink)>;

/// Maps the window along the tracker's motion, then finds the correction of the motion from the
/// depth and maps again along the corrected motion, as long as the fused DSI becomes sharper.
/// @return the sharpest keyframe, with its correction if there is one.
KeyframeDepthMap mapCorrected(const CorrectedWindow& window, const MapAlong& map_along);

}  // namespace efm
