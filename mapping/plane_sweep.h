// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <vector>

#include "mapping/space_sweep.h"

namespace efm {

/// Fills a plane, whose values are to be cleared first, with the ray density of one camera in one
/// slot. Called from several threads, for different planes.
using PlaneVoter = std::function<VoteCounts(int camera, int slot, int plane, PlaneValues& density)>;

/// A pass over the planes, each as a whole, whatever votes: groups of planes side by side. Memory:
/// O(threads * width * height), whatever the number of planes, cameras and sub-intervals.
SweepResult sweepPlanes(const PlaneVoter& voter, const FusionInputs& inputs,
                        const ReferenceView& view, const DepthPlanes& planes,
                        const SpaceSweepOptions& options, const SweepRequest& request);

/// The sweep of rays as the plain kernel runs it, the specification.
SweepResult sweepPlanes(const std::vector<CameraRays>& cameras, const ReferenceView& view,
                        const DepthPlanes& planes, const SpaceSweepOptions& options,
                        const SweepRequest& request);

}  // namespace efm
