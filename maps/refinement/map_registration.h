// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <vector>

#include "mapping/geometry/rigid3.h"
#include "maps/refinement/registration_points.h"

namespace efm {

/// A keyframe of a map that is registered with another map.
struct PosedCloud {
  RegistrationCloud cloud;
  Rigid3 T_world_ref;
};

/// How one map lies in the world of another one.
struct MapRegistration {
  Rigid3 T_fixed_moved;  ///< Moves the points of the second map.
  double moved_m = 0;    ///< By how much it moves the middle of the second map's keyframes.
  double moved_rad = 0;
  /// Standard deviations of that, in the least certain direction, by the differences between the
  /// pairs.
  double sigma_m = 0, sigma_rad = 0;
  std::size_t pairs = 0;    ///< Pairs of keyframes that agree about it.
  std::size_t checked = 0;  ///< Pairs that were registered.
};

/// Finds how a map lies relative to another one that shares places with it, by pairs of keyframes:
/// each is checked as a loop is (`verifyLoop`). Corrects about 5 % of the scene's depth, and 3
/// degrees.
/// @param fixed, moved the keyframes of both; some of each are enough.
/// @throws std::runtime_error if no pair sees the same place, or the pairs do not agree.
MapRegistration registerMap(const std::vector<PosedCloud>& fixed,
                            const std::vector<PosedCloud>& moved);

}  // namespace efm
