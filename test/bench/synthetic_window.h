// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <vector>

#include "mapping/events/event.h"
#include "mapping/events/window.h"
#include "mapping/geometry/rig.h"
#include "mapping/geometry/trajectory.h"
#include "mapping/keyframes/keyframe_mapper.h"

namespace efm::bench {

struct SyntheticWindowOptions {
  int width = 346;
  int height = 260;
  std::size_t events_per_camera = 235'000;
  int cameras = 2;  ///< Side by side, 0.1 m apart.
  double duration_s = 0.2;
  unsigned seed = 1;
};

/// The events of a window of a hand-held rig that looks at straight edges 1 to 6 m away. Every
/// tenth event is noise. They are made from the edges without images: millions of events in less
/// than a second, with positions and times like real events.
struct SyntheticWindow {
  Rig rig;
  Trajectory trajectory;
  Window window;
  std::vector<std::vector<Event>> events;  ///< Per camera, in time order.
  KeyframeMapperOptions options;  ///< 100 planes, 0.8 to 8 m, the paper's fusion and depths.
};

SyntheticWindow makeSyntheticWindow(const SyntheticWindowOptions& options);

}  // namespace efm::bench
