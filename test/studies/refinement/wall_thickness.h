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
  Rectangle whole;            ///< Around all of its panels; normal into the room.
  std::vector<int> surfaces;  ///< The scene's, of its plane.
};

/// The planes that the scene lies before, to within 1 cm: those around a room, not the faces of
/// what stands in it, which have the room's walls behind them.
std::vector<Wall> wallsOf(const Scene& scene);

/// A point of a map and the surface that it is nearest to.
struct NearPoint {
  Eigen::Vector3d p_world;
  NearestSurface nearest;
};

/// How widely the points that belong to a wall are spread across it.
struct WallThickness {
  double thickness_m = 0;  ///< Half of what lies between the 16th and 84th percentile; 0 of none.
  std::size_t points = 0;
};

/// Of the points that are nearest to the wall, at most 0.3 m from it and at least as far inside its
/// borders: as a standard deviation, but for what is far off. A wall that stands twice is thick.
WallThickness thicknessOf(const Wall& wall, const std::vector<NearPoint>& points);

/// Mean of all walls, weighted by their points.
WallThickness meanThickness(const std::vector<Wall>& walls, const std::vector<NearPoint>& points);

}  // namespace efm::studies
