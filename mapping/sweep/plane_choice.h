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

/// Returns every `step`-th plane, and the last one. Both numbers are at least 1.
PlaneSet coarsePlanes(int planes, int step);

/// Returns the planes between two coarse planes of which one has more than a hundredth of a tile's
/// contrast. Contrast is the confidence of a pixel above that of its surroundings, on the plane of
/// its peak. On the other planes are noise and a few edges: coarse planes are fine enough.
/// @param peaks of the coarse planes. @param window see `surroundingsOf`.
PlaneSet planesAtEdges(const PlaneSet& coarse, const RunningPeaks& peaks, cv::Size tile,
                       int window);

}  // namespace efm
