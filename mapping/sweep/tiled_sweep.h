// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "mapping/sweep/space_sweep.h"

namespace efm {

/// The sweep as the fast kernels run it, tile by tile: for a small rectangle of the view, the votes
/// of all cameras and sub-intervals on one plane, their fusion and the running peaks stay in the
/// first two levels of cache, and no plane exists as a whole. Planes are taken in groups; in each,
/// a tile looks up once which rays it may see. Memory beside the rays: O(width * height), whatever
/// the number of planes, cameras, sub-intervals and threads.
///
/// Tiles share nothing, and a tile's votes have an order: the result is the same, bit for bit, for
/// any number of threads.
/// @param cameras given up piece by piece, as they are sorted into bins.
SweepResult sweepTiles(std::vector<CameraRays> cameras, const ReferenceView& view,
                       const DepthPlanes& planes, const SpaceSweepOptions& options,
                       const SweepRequest& request);

}  // namespace efm
