// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "mapping/events/event.h"
#include "mapping/events/window.h"
#include "mapping/geometry/depth_planes.h"
#include "mapping/geometry/reference_view.h"
#include "mapping/geometry/rig.h"
#include "mapping/geometry/rigid3.h"
#include "mapping/geometry/undistortion.h"

namespace efm {

/// One camera's events of a window, and the calibration that makes rays of them. Owns nothing.
struct CameraEvents {
  int camera = 0;  ///< Index in the rig.
  const RigCamera* calibration = nullptr;
  const UndistortionTable* undistortion = nullptr;
  EventSpan events;  ///< In time order, on the trajectory's clock, inside the sensor.
};

/// One window: the events of the selected cameras, and the view and planes of its DSI. Owns
/// nothing.
struct WindowInput {
  const Window& window;
  const std::vector<CameraEvents>& cameras;
  const ReferenceView& view;
  const DepthPlanes& planes;
  Rigid3 T_world_ref;  ///< Pose of the reference view.
};

}  // namespace efm
