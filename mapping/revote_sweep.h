// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "mapping/revoting.h"
#include "mapping/space_sweep.h"
#include "mapping/split_fusion.h"

namespace efm {

/// The sweep with re-voting: the first pass fuses a prior for each polarity that groups are split
/// by, the second votes the shares of all groups together. Its fusion is that of the inputs, whose
/// groups are not told apart any more. The votes that are counted are those of the first pass.
/// Memory: two bytes per voxel of each prior, and of few shares 12 bytes each.
/// @param polarities of the groups: the fastest index of theirs. 1: not split by polarity.
/// @param request what to give of the second pass; its `groups` are those of the rays.
SweepResult sweepTwice(SplitRays rays, int polarities, const ReferenceView& view,
                       const DepthPlanes& planes, const SpaceSweepOptions& options,
                       const VoteSharing& sharing, const SweepRequest& request);

}  // namespace efm
