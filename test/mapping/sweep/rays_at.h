// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <vector>

#include "mapping/sweep/tiles.h"

namespace efm::test {

/// Three tiles by three, the last of which ends at the view's border.
inline const ReferenceView kTiledView{150, 130, 100, 100, 75, 65};

/// A pixel in the unit of a tile's rays.
inline constexpr float kTileUnit = 1 << kernels::kFractionBits;

/// Rays that meet every plane at points of the view, in pixels, for a tile to vote with.
inline TileRays raysAt(const std::vector<Eigen::Vector2d>& points, const cv::Point& origin) {
  TileRays rays;
  rays.reserve(points.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    rays.view().x[i] = static_cast<float>(points[i].x() - origin.x) * kTileUnit;
    rays.view().y[i] = static_cast<float>(points[i].y() - origin.y) * kTileUnit;
    rays.view().dx[i] = rays.view().dy[i] = 0;
  }
  rays.resize(points.size());
  rays.pad();
  return rays;
}

}  // namespace efm::test
