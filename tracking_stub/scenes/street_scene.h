// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "tracking_stub/scenes/scene.h"

namespace efm {

struct StreetOptions {
  /// The path of the vehicle: points in order, at least two different ones, at most metres apart.
  /// Frame `world`: z up, the road is at z = 0.
  std::vector<Eigen::Vector2d> path;
  double min_length_m =
      50;  ///< Min length from the first point of the path to the house at the end.
  double min_ahead_m = 25;  ///< Min length from the last point of the path to that house.
  double focal_px = 550;    ///< Longest focal length of the cameras.
  std::uint64_t seed = 0;
};

/// A street along a path: a painted road, houses at both sides, a house across its end, and random
/// lamp posts, parked cars and bins at the roadside. Nothing is within 3 m of the path. There are
/// no surfaces above the houses: the sky.
Scene makeStreet(const StreetOptions& options);

}  // namespace efm
