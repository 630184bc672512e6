// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <cstdint>

#include "tracking_stub/scenes/scene.h"

namespace efm {

struct RoomOptions {
  Eigen::Vector3d size_m = {6, 5, 2.6};  ///< Length, width, height; at least 3 x 3 x 2.
  /// Nothing but the walls stands farther from the middle of the room than to within this of them.
  double furniture_depth_m = 0.6;
  double nearest_m = 0.9;  ///< The nearest that anything is seen from.
  double focal_px = 226;   ///< Of the sharpest camera that will look.
  std::uint64_t seed = 0;
};

/// A furnished room: painted walls, floor and ceiling, and along the walls cupboards, tables,
/// shelves, lamps on thin poles and pictures, other ones for every seed. The middle is free. Frame
/// `world`: origin in the middle of the floor, x along the length, z up.
Scene makeRoom(const RoomOptions& options);

}  // namespace efm
