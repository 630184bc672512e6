// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "mapping/geometry/reference_view.h"
#include "mapping/rays/rays.h"
#include "mapping/sweep/space_sweep.h"
#include "test/bench/synthetic_window.h"

namespace efm::bench {

/// The input of a sweep: events as rays.
struct SweepInput {
  ReferenceView view;
  DepthPlanes planes;
  std::vector<CameraRays> cameras;
  std::vector<PosePackets> packets;  ///< Per camera, of its events.
};

/// Back-projects the window's cameras into the view of the first.
SweepInput makeSweepInput(const SyntheticWindow& made, int planes);

}  // namespace efm::bench
