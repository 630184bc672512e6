// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <opencv2/core/types.hpp>

#include "mapping/dsi/plane_values.h"
#include "mapping/dsi/voting_kernel.h"
#include "mapping/kernels/tile_resolve.h"

namespace efm {

/// One input's votes on a tile of a plane, in cells (`kernels/tile_vote.h`) until ray densities are
/// worked out of them: of all pixels, or of those that turn out to matter.
class TileVotes {
 public:
  /// @param kernel one of `runnableKernels`, but not the plain one.
  explicit TileVotes(VotingKernel kernel);

  /// For whoever votes.
  kernels::MarkedCells cells() { return {cells_.data(), marks_.data()}; }

  /// The densities of all pixels of the tile, row-major; no vote is left.
  /// @return the votes of the cells right of and below the first ones.
  std::uint64_t foldAll(const cv::Size& tile, float* density);
  /// Finds the pixels that votes fall on. @return as above.
  std::uint64_t find(const cv::Size& tile);
  /// Whether votes were found and wait to be folded.
  bool waiting() const { return waiting_; }
  /// What was found.
  const kernels::TilePixels& found() const { return pixels_; }
  /// The blocks that hold any of some pixels.
  kernels::PixelBlocks blocksOf(const kernels::TilePixels& pixels) const;
  /// The densities in some blocks; no vote that was found is left.
  void foldSome(const kernels::PixelBlocks& blocks, float* density);

 private:
  const kernels::FoldFunctions* functions_;
  PixelValues<std::uint64_t> cells_;
  PixelValues<std::uint8_t> marks_;
  kernels::TilePixels pixels_;
  kernels::MarkedLines lines_;
  bool waiting_ = false;
};

/// The ray density of one input on a tile of a plane.
struct TileDensity {
  float* values = nullptr;  ///< One per pixel of the tile, row-major, where they are asked for.
  bool may_wait = false;    ///< Whether votes need not be folded yet; of two inputs at a time.
  /// The votes that wait, found but not folded, until it is known which pixels matter; null where
  /// the values are there.
  TileVotes* waiting = nullptr;
};

}  // namespace efm
