// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "mapping/sweep/space_sweep.h"

namespace efm {

/// The sweep of rays as the plain kernel runs it, the specification: whole planes, groups of them
/// on several threads. Memory: O(threads * width * height), whatever the number of planes, cameras
/// and sub-intervals.
SweepResult sweepPlanes(const std::vector<CameraRays>& rays, const ReferenceView& view,
                        const DepthPlanes& planes, const SpaceSweepOptions& options,
                        const SweepRequest& request);

}  // namespace efm
