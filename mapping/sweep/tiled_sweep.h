// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <opencv2/core/types.hpp>
#include <vector>

#include "mapping/sweep/space_sweep.h"

namespace efm {

/// Cuts the view into rectangles of nearly the same size, at most `max_pixels` on a side: row by
/// row, without gap or overlap.
std::vector<cv::Rect> tilesOf(const ReferenceView& view, int max_pixels);

/// The sweep with the fast kernels, tile by tile. A tile is a small rectangle of the view: its
/// votes on one plane, their fusion and the running peaks stay in the first two levels of cache,
/// and no plane exists as a whole. Planes come in groups; a tile gathers its rays once per group.
/// Memory besides the rays: O(width * height), for any number of planes, cameras, sub-intervals and
/// threads.
///
/// Tiles share nothing, and a tile's votes have an order: the result has the same bits for any
/// number of threads.
/// @param cameras consumed: each bundle is freed when it is sorted into bins.
SweepResult sweepTiles(std::vector<CameraRays> cameras, const DsiGrid& grid,
                       const SpaceSweepOptions& options, const SweepRequest& request);

}  // namespace efm
