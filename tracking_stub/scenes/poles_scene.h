// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>

#include "tracking_stub/scenes/scene.h"

namespace efm {

struct PolesOptions {
  double nearest_m = 0.9;  ///< The poles stand at this depth and more, above 0,
  double farthest_m = 3;   ///< up to this one, above nearest_m.
  double wall_m = 4;       ///< Depth of the wall behind them, above farthest_m.
  /// Half of what the camera sees at a depth of 1 m, to the side: the poles stand in the view.
  double half_view = 0.75;
  double focal_px = 226;  ///< Of the sharpest camera that will look.
  int poles = 11;
  std::uint64_t seed = 0;
};

/// Thin poles, upright and leaning, at depths that differ, before a painted wall: depth has edges
/// everywhere, and little surface. Frame `world`: seen from around the origin along y, x right, z
/// up.
Scene makePoles(const PolesOptions& options);

}  // namespace efm
