// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "mapping/space_sweep.h"

namespace efm {

/// The sweep as the plain kernel runs it, the specification: each plane as a whole, groups of
/// planes side by side. Memory beside the rays: O(threads * width * height), whatever the number
/// of planes, cameras and sub-intervals.
SweepResult sweepPlanes(const std::vector<CameraRays>& cameras, const ReferenceView& view,
                        const DepthPlanes& planes, const SpaceSweepOptions& options,
                        const SweepRequest& request);

}  // namespace efm
