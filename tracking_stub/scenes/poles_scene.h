// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>

#include "tracking_stub/scenes/scene.h"

namespace efm {

struct PolesOptions {
  double nearest_m = 0.9;  ///< Min depth of the poles, above 0.
  double farthest_m = 3;   ///< Max depth of the poles, above nearest_m.
  double wall_m = 4;       ///< Depth of the wall behind the poles, above farthest_m.
  /// Half of the width of the view at a depth of 1 m. The poles are in the view.
  double half_view = 0.75;
  double focal_px = 226;  ///< Longest focal length of the cameras.
  int poles = 11;
  std::uint64_t seed = 0;
};

/// Thin poles, upright and leaning, at different depths before a painted wall: many depth edges and
/// little surface. Frame `world`: y forward, x right, z up; the cameras are near the origin.
Scene makePoles(const PolesOptions& options);

}  // namespace efm
