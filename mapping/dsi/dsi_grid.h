// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "mapping/geometry/depth_planes.h"
#include "mapping/geometry/reference_view.h"

namespace efm {

/// The voxels of a DSI: the pixels of the reference view on each depth plane.
struct DsiGrid {
  ReferenceView view;
  DepthPlanes planes;
};

}  // namespace efm
