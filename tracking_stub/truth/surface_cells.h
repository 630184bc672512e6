// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "tracking_stub/scenes/scene.h"

namespace efm {

/// Counts on a fine grid over every surface of a scene.
class SurfaceCells {
 public:
  /// @param scene outlives the cells.
  /// @param cell_m wanted side of a cell; each surface takes the nearest that divides its sides.
  SurfaceCells(const Scene& scene, double cell_m);

  /// Adds one to the place's cell; a place on no surface does not count.
  void add(const SurfacePoint& place);

  /// Centres of the cells that were counted at least so often, frame `world`.
  std::vector<Eigen::Vector3f> centers(std::uint32_t at_least) const;

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
