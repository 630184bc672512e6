// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "mapping/events/event.h"
#include "mapping/events/window.h"
#include "mapping/geometry/trajectory.h"

namespace efm {

/// Events and poses of a window; owns nothing.
struct WindowData {
  Window window;
  std::vector<EventSpan> events;           ///< Per camera of the rig, on the trajectory's clock.
  const Trajectory* trajectory = nullptr;  ///< Has at least the poses of the window.
};

}  // namespace efm
