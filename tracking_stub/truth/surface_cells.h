// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "tracking_stub/scenes/scene.h"

namespace efm {

/// Counters on a fine grid over every surface of a scene.
class SurfaceCells {
 public:
  /// @param scene outlives the cells.
  /// @param cell_m side of a cell. Each surface rounds it to a divisor of its sides.
  SurfaceCells(const Scene& scene, double cell_m);

  /// Adds one to the cell of a point. A point without a surface is ignored.
  void add(const SurfacePoint& point);

  /// Centres of the cells with at least this count, frame `world`.
  std::vector<Eigen::Vector3f> centers(std::uint32_t min_count) const;

 private:
  struct Grid {
    int columns = 1;
    int rows = 1;
    std::vector<std::uint32_t> counts;  // row-major
  };

  const Scene* scene_;
  std::vector<Grid> grids_;  // per surface
};

}  // namespace efm
