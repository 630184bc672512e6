// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <vector>

#include "mapping/keyframes/keyframe_depth_map.h"
#include "maps/refinement/keyframe_refiner.h"

namespace efm::studies {

/// The result of false loops.
struct FalseLoops {
  int proposed = 0;
  int accepted = 0;
  double moved_m = 0;  ///< Max change of a pose by the false loops.
  double moved_rad = 0;
};

/// Refines the keyframes again with false loops. True loops are searched, too. After each keyframe,
/// with a probability of 0.3, a false loop to an older keyframe is proposed. The two kinds
/// alternate; if one is impossible, the other is used:
///   - two different places (an overlap below 5 %), claimed to be within 0.3 m and 15 degrees;
///   - one place (an overlap of at least 30 %) with a relative pose that is wrong by 0.3 to 1 m, by
///   15
///     to 45 degrees, or by both.
/// @param T_world_true the true poses of the keyframes.
/// @param T_world_ref the refined poses without false loops.
FalseLoops proposeFalseLoops(const std::vector<KeyframeDepthMap>& keyframes,
                             const std::vector<Rigid3>& T_world_true,
                             const std::vector<Rigid3>& T_world_ref,
                             const RefinementOptions& options, std::uint64_t seed);

}  // namespace efm::studies
