// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <opencv2/core.hpp>

#include <vector>

#include "mapping/dsi/dsi_columns.h"
#include "mapping/geometry/reference_view.h"

namespace efm {

/// Flags, one per plane.
using PlaneSet = std::vector<bool>;

/// Returns the distance of the planes that are swept first: 1 (all) to 3. They are at most about
/// the width of a peak apart.
/// @param range_px the parallax between the first and the last plane, pixels.
int coarseStep(const DepthPlanes& planes, const ReferenceView& view, double range_px);

/// Returns every `step`-th plane, and the last one.
PlaneSet coarsePlanes(int planes, int step);

/// Returns the planes that are not coarse and next to a coarse plane on which a part of a tile's
/// edges lies: pixels that stand out from their surroundings in confidence. Elsewhere, the DSI has
/// noise, for whose depth the coarse planes are fine enough.
/// @param peaks of the coarse planes. @param window as for `DsiColumns::select`.
PlaneSet planesAtEdges(const PlaneSet& coarse, const RunningPeaks& peaks, cv::Size tile,
                       int window);

}  // namespace efm
