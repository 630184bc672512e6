// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <opencv2/core.hpp>
#include <optional>
#include <utility>
#include <vector>

#include "mapping/dsi/dsi_columns.h"
#include "mapping/dsi/dsi_peaks.h"
#include "mapping/dsi/plane_values.h"
#include "mapping/dsi/swept_dsi.h"
#include "mapping/dsi/voting_kernel.h"

namespace efm {

/// What is found on one tile of the view at a time, of the fused DSI or of one camera's.
class TileFinds {
 public:
  /// @param largest how many pixels a tile has at most.
  TileFinds(int planes, int ray_window, std::size_t largest)
      : planes_(planes),
        ray_window_(ray_window),
        volume_(ray_window > 0 ? planes : 0, ray_window > 0 ? largest : 0) {}

  void moveTo(const cv::Rect& tile, VotingKernel kernel) {
    tile_ = tile;
    peaks_.emplace(static_cast<std::size_t>(tile.area()), kernel);
  }
  /// Planes in increasing order, without a gap.
  void take(int plane, const PlaneValues& values) {
    peaks_->take(plane, values);
    if (ray_window_ > 0) volume_.take(plane, values);
  }
  /// Writes into places of the tile's own.
  void writeTo(DsiPeaks& peaks, DsiRays::Tile& rays) const {
    peaks_->writeTo(peaks, tile_);
    if (ray_window_ > 0) {
      rays = DsiRays::pick(tile_, peaks.confidence(tile_), volume_, planes_, ray_window_);
    }
  }

 private:
  int planes_;
  int ray_window_;
  cv::Rect tile_;
  std::optional<RunningPeaks> peaks_;
  TileVolume volume_;
};

/// What is found on all tiles.
struct Found {
  DsiPeaks peaks;
  std::vector<DsiRays::Tile> rays;  // by tile

  Found(const ReferenceView& view, std::size_t tiles) : peaks(unwrittenPeaks(view)), rays(tiles) {}
  /// @param with_rays that rays were asked for: without them there is nothing to find them by.
  SweptDsi whole(int planes, bool with_rays) {
    if (!with_rays) return {peaks, {}};
    return {peaks, DsiRays(peaks.confidence.size(), planes, std::move(rays))};
  }
};

}  // namespace efm
