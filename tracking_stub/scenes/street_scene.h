// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "tracking_stub/scenes/scene.h"

namespace efm {

struct StreetOptions {
  /// Where the vehicle drives: points in order, at least two that differ, metres apart or less.
  /// Frame `world`: z up, the road is at z = 0.
  std::vector<Eigen::Vector2d> path;
  double reach_m = 50;    ///< The street is closed by a house so far from the path's beginning,
  double ahead_m = 25;    ///< but at least so far from its end.
  double focal_px = 550;  ///< Of the sharpest camera that will look.
  std::uint64_t seed = 0;
};

/// A street along a path: a road with markings and patches, houses at both sides, a house across
/// its end, and at the roadside lamp posts, parked cars and bins, other ones for every seed.
/// Nothing stands within 3 m of the path. Above the houses is nothing: the sky.
Scene makeStreet(const StreetOptions& options);

}  // namespace efm
