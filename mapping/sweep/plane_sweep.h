// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "mapping/sweep/space_sweep.h"

namespace efm {

/// The sweep with the plain kernel, the specification: whole planes, one per thread at a time.
/// Memory: O(threads * width * height), for any number of planes, cameras and sub-intervals.
SweepResult sweepPlanes(const std::vector<CameraRays>& cameras, const DsiGrid& grid,
                        const SpaceSweepOptions& options, const SweepRequest& request);

}  // namespace efm
