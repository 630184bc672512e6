// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <cstdint>

#include "tracking_stub/scenes/scene.h"

namespace efm {

struct RoomOptions {
  Eigen::Vector3d size_m = {6, 5, 2.6};  ///< Length, width, height; at least 3 x 3 x 2.
  /// Max depth of the furniture along the walls.
  double furniture_depth_m = 0.6;
  double nearest_m = 0.9;  ///< The shortest distance of a surface to a camera.
  double focal_px = 226;   ///< Longest focal length of the cameras.
  std::uint64_t seed = 0;
};

/// A furnished room: painted walls, floor and ceiling, and random furniture along the walls. The
/// middle is free. Frame `world`: origin in the middle of the floor, x along the length, z up.
Scene makeRoom(const RoomOptions& options);

}  // namespace efm
