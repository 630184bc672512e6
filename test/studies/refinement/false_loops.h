// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <vector>

#include "mapping/keyframes/keyframe_depth_map.h"
#include "maps/refinement/keyframe_refiner.h"

namespace efm::studies {

/// What became of loops that are none.
struct FalseLoops {
  int proposed = 0;
  int accepted = 0;
  double moved_m = 0;  ///< The farthest that any pose is from where it is without them.
  double moved_rad = 0;
};

/// Refines the keyframes once more, with false loops; true ones are looked for as ever.
/// After each keyframe, with a probability of 0.3, one false candidate is proposed with an older
/// one. By turns: a place that the two do not share (less than 5 % of the points truly in view),
/// said to be the same to within 0.3 m and 15 degrees of where the older one stands; and, of two
/// that truly share 30 % or more, a relative pose that is wrong by 0.3 to 1 m and 15 to 45 degrees,
/// or by one of these. Where there is none of the one kind, one of the other is taken.
/// @param T_world_true the true poses of the keyframes.
/// @param T_world_ref where they end without false loops.
FalseLoops proposeFalseLoops(const std::vector<KeyframeDepthMap>& keyframes,
                             const std::vector<Rigid3>& T_world_true,
                             const std::vector<Rigid3>& T_world_ref,
                             const RefinementOptions& options, std::uint64_t seed);

}  // namespace efm::studies
