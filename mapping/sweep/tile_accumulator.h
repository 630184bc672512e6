// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>
#include <opencv2/core/types.hpp>
#include <vector>

#include "mapping/dsi/voting_kernel.h"
#include "mapping/geometry/reference_view.h"
#include "mapping/kernels/tile_scatter.h"
#include "mapping/sweep/tile_rays.h"
#include "mapping/sweep/tile_votes.h"

namespace efm {

/// Votes on one tile of the view, plane by plane. One per thread.
class TileVoter {
 public:
  /// @param kernel one of `runnableKernels`, but not the plain one.
  explicit TileVoter(VotingKernel kernel);

  /// Turns to a tile of at most `kTilePixels` on a side.
  void moveTo(const cv::Rect& tile, const ReferenceView& view);
  static constexpr int kTilePixels = kernels::kTileCells - 1;

  /// The cells that the tile's pixels get votes from, by their upper left pixels.
  const cv::Rect& cells() const { return inside_; }
  const kernels::TileFunctions& functions() const { return functions_; }
  /// What coordinates of rays count from, for `RayBins::gather`.
  cv::Point origin() const;

  /// The ray density on one plane.
  /// @param rays padded. @param to_plane from the rays' home plane, 1/m.
  /// @param density one value per pixel of the tile, row-major.
  /// @return the votes of the cells whose upper left pixel lies in the tile: over all tiles, those
  /// of all cells.
  std::uint64_t vote(TileRays& rays, double to_plane, float* density);
  /// The same; votes of few rays wait where they may.
  std::uint64_t vote(TileRays& rays, double to_plane, TileDensity& density);

 private:
  /// Casts the votes. @return one past the last full cell.
  const kernels::FullCell* cast(TileRays& rays, double to_plane, TileVotes& votes);
  std::uint64_t addFullCells(const kernels::FullCell* end, float* density) const;

  const kernels::TileFunctions& functions_;
  std::array<TileVotes, 2> votes_;  // one of them may wait while another input votes
  std::vector<kernels::FullCell> full_;
  cv::Rect tile_;
  cv::Rect inside_;                 // the tile's cells that are inside the view
  std::uint32_t first_inside_ = 0;  // which cell of the tile is the first of them
};

}  // namespace efm
