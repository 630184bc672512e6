// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <vector>

#include "test/tracking_stub/truth/nearest_surface.h"
#include "tracking_stub/scenes/scene.h"

namespace efm::studies {

/// A wall, the floor or the ceiling of a room.
struct Wall {
  Rectangle whole;            ///< Around all panels. The normal points into the room.
  std::vector<int> surfaces;  ///< The surfaces of the scene in its plane.
};

/// The planes of the scene with no surface behind them, within 1 cm: the walls of a room. Faces of
/// furniture have a wall behind them.
std::vector<Wall> wallsOf(const Scene& scene);

/// A point of a map and its nearest surface.
struct NearPoint {
  Eigen::Vector3d p_world;
  NearestSurface nearest;
};

/// The spread of the points of a wall across it.
struct WallThickness {
  double thickness_m =
      0;  ///< Half of the distance between the 16th and 84th percentile; 0 without points.
  std::size_t points = 0;
};

/// The thickness by the points that are nearest to the wall, at most 0.3 m from it and at least 0.3
/// m inside its borders: a robust standard deviation. A doubled wall is thick.
WallThickness thicknessOf(const Wall& wall, const std::vector<NearPoint>& points);

/// Mean of all walls, weighted by points.
WallThickness meanThickness(const std::vector<Wall>& walls, const std::vector<NearPoint>& points);

}  // namespace efm::studies
