// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>

#include <cstdint>
#include <vector>

#include "tracking_stub/scenes/scene.h"

namespace efm {

struct RoomOptions {
  Eigen::Vector3d size_m = {6, 5, 2.6};  ///< Length, width, height; at least 3 x 3 x 2.
  /// Maximum depth of the furniture along the walls.
  double furniture_depth_m = 0.6;
  double nearest_m = 0.9;  ///< The shortest distance of a surface to a camera.
  double focal_px = 226;   ///< Longest focal length of the cameras.
  std::uint64_t seed = 0;
};

/// Makes a furnished room: painted walls, floor and ceiling, and random furniture along the walls.
/// The middle is free. Frame `world`: origin in the middle of the floor, x along the length, z up.
Scene makeRoom(const RoomOptions& options);

struct PolesOptions {
  double nearest_m = 0.9;  ///< Minimum depth of the poles, above 0.
  double farthest_m = 3;   ///< Maximum depth of the poles, above nearest_m.
  double wall_m = 4;       ///< Depth of the wall behind the poles, above farthest_m.
  /// Half of the width of the view at a depth of 1 m, metres. The poles are in the view.
  double half_view = 0.75;
  double focal_px = 226;  ///< Longest focal length of the cameras.
  int poles = 11;
  std::uint64_t seed = 0;
};

/// Makes thin poles, upright and leaning, at different depths before a painted wall: many depth
/// edges, little surface. Frame `world`: y forward, x right, z up; cameras are near the origin.
Scene makePoles(const PolesOptions& options);

struct StreetOptions {
  /// The path of the vehicle: points in order, at least two different points, a few metres apart.
  /// Frame `world`: z up, the road is at z = 0.
  std::vector<Eigen::Vector2d> path;
  /// Minimum length from the first point of the path to the house at the end.
  double min_length_m = 50;
  double focal_px = 550;  ///< Longest focal length of the cameras.
  std::uint64_t seed = 0;
};

/// Makes a street along a path: a painted road, houses at both sides, a house across its end, and
/// random lamp posts, parked cars and bins at the roadside. No object is within 3 m of the path.
/// There are no surfaces above the houses, only sky.
Scene makeStreet(const StreetOptions& options);

}  // namespace efm
