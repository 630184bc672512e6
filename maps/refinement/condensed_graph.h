// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>

#include "maps/refinement/keyframe_graph.h"

namespace efm {

/// Above this number of free keyframes, loops are solved by `solveCondensed`.
constexpr std::size_t kMaxSolvedTogether = 500;

/// Solves loops over any number of keyframes with at most `kMaxSolvedTogether` free poses: those of
/// anchors, which are keyframes at equal distances in number. Between two anchors the motion is the
/// current one, with the drift of the tracker; a loop counts between the anchors before its
/// keyframes, at most a few per anchor. The other keyframes follow the anchors around them. So the
/// cost hardly grows with the number of keyframes, and small errors between anchors stay.
/// @param first_free the keyframes before it are fixed. At least 1, and below the newest keyframe.
/// Counts in `failed_solves`, and moves nothing, where the minimum cannot be computed.
void solveCondensed(KeyframeGraph& graph, std::size_t first_free, const PoseGraphOptions& options);

}  // namespace efm
