// SPDX-License-Identifier: BSD-3-Clause
#include "tracking_stub/truth/surface_cells.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "mapping/base/named_choice.h"

namespace efm {
namespace {

int cellsAlong(double length_m, double cell_m) {
  return std::max(1, static_cast<int>(std::lround(length_m / cell_m)));
}

/// The last cell contains its far border.
int cellOf(double position_m, double length_m, int cells) {
  return std::clamp(static_cast<int>(position_m / length_m * cells), 0, cells - 1);
}

}  // namespace

SurfaceCells::SurfaceCells(const Scene& scene, double cell_m) : scene_(&scene) {
  requireOption(cell_m > 0, "cell_m", cell_m, "above 0");
  for (int surface = 0; surface < scene.size(); ++surface) {
    const Rectangle& r = scene.rectangle(surface);
    Grid grid;
    grid.columns = cellsAlong(r.width_m, cell_m);
    grid.rows = cellsAlong(r.height_m, cell_m);
    grid.counts.resize(static_cast<std::size_t>(grid.columns) *
                       static_cast<std::size_t>(grid.rows));
    grids_.push_back(std::move(grid));
  }
}

void SurfaceCells::add(const SurfacePoint& point) {
  if (point.surface < 0) return;
  const Rectangle& r = scene_->rectangle(point.surface);
  Grid& grid = grids_[static_cast<std::size_t>(point.surface)];
  const int column = cellOf(point.u_m, r.width_m, grid.columns);
  const int row = cellOf(point.v_m, r.height_m, grid.rows);
  ++grid.counts[static_cast<std::size_t>(row) * static_cast<std::size_t>(grid.columns) +
                static_cast<std::size_t>(column)];
}

std::vector<Eigen::Vector3f> SurfaceCells::centers(std::uint32_t min_count) const {
  std::vector<Eigen::Vector3f> centers;
  for (int surface = 0; surface < scene_->size(); ++surface) {
    const Rectangle& r = scene_->rectangle(surface);
    const Grid& grid = grids_[static_cast<std::size_t>(surface)];
    auto count = grid.counts.begin();
    for (int row = 0; row < grid.rows; ++row) {
      for (int column = 0; column < grid.columns; ++column) {
        if (*count++ < min_count) continue;
        const Eigen::Vector3d center = r.pointAt((column + 0.5) * r.width_m / grid.columns,
                                                 (row + 0.5) * r.height_m / grid.rows);
        centers.push_back(center.cast<float>());
      }
    }
  }
  return centers;
}

}  // namespace efm
