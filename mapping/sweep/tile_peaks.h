// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <opencv2/core.hpp>
#include <optional>
#include <utility>
#include <vector>

#include "mapping/dsi/dsi_columns.h"
#include "mapping/dsi/dsi_grid.h"
#include "mapping/dsi/dsi_peaks.h"
#include "mapping/dsi/plane_values.h"
#include "mapping/dsi/voting_kernel.h"

namespace efm {

/// The peaks and columns of one DSI on all tiles: the fused one, or one camera's. With columns, of
/// the peaks the confidence alone.
class ViewPeaks {
 public:
  ViewPeaks(const DsiGrid& grid, int column_window, std::size_t tiles)
      : planes_(grid.planes.size()),
        column_window_(column_window),
        peaks_(unwrittenPeaks(grid.view, column_window > 0)),
        columns_(tiles) {}

  /// The whole view, when every tile is written. Its columns are moved out.
  SweptDsi sweptDsi() {
    if (column_window_ == 0) return {peaks_, {}};
    return {peaks_, DsiColumns(peaks_.confidence.size(), planes_, std::move(columns_))};
  }

 private:
  friend class TilePeaks;

  int planes_;
  int column_window_;
  DsiPeaks peaks_;
  std::vector<DsiColumns::Tile> columns_;  // by tile
};

/// The peaks and columns of one DSI on one tile at a time.
class TilePeaks {
 public:
  /// @param max_pixels of a tile.
  TilePeaks(int planes, int column_window, std::size_t max_pixels)
      : volume_(column_window > 0 ? planes : 0, column_window > 0 ? max_pixels : 0) {}

  void moveTo(const cv::Rect& tile, VotingKernel kernel) {
    tile_ = tile;
    peaks_.emplace(static_cast<std::size_t>(tile.area()), kernel);
  }
  /// Planes in increasing order, without a gap.
  void add(int plane, const PlaneValues& values) {
    peaks_->add(plane, values);
    if (!volume_.empty()) volume_.setPlane(plane, values);
  }
  /// Writes the tile to its position in the view. Several threads may write different tiles.
  void writeTo(ViewPeaks& view, std::size_t tile) const {
    peaks_->writeTo(view.peaks_, tile_);
    if (volume_.empty()) return;
    view.columns_[tile] = DsiColumns::select(tile_, view.peaks_.confidence(tile_), volume_,
                                             view.planes_, view.column_window_);
  }

 private:
  cv::Rect tile_;
  std::optional<RunningPeaks> peaks_;
  TileVolume volume_;
};

}  // namespace efm
