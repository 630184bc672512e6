// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "mapping/dsi/plane_values.h"
#include "mapping/dsi/voting_kernel.h"
#include "mapping/kernels/tile_resolve.h"
#include "mapping/kernels/tile_scatter.h"
#include "mapping/sweep/tile_rays.h"

namespace efm {

/// Sums the votes of one input on one tile of a plane in cells (`kernels/tile_scatter.h`) and
/// resolves them into ray densities: of all pixels, or of some blocks.
///
/// Use: `vote`; then `resolve`, or, where `isSparse`, `findOccupied` and `resolveBlocks`.
class TileAccumulator {
 public:
  /// @param kernel one of `availableKernels`, but not the plain one.
  explicit TileAccumulator(VotingKernel kernel);

  /// Moves to a tile. No votes are pending (asserted).
  void moveTo(const TileCells& tile);

  /// Votes with the tile's rays on one plane.
  /// @param rays padded. @param from_first from the plane of the rays' pixels to this one, 1/m.
  void vote(TileRays& rays, double from_first);
  /// Whether the votes are so few that it pays to skip empty cells.
  bool isSparse() const { return sparse_; }

  /// Resolves all pixels; no vote is left.
  /// @param density one value per pixel of the tile, row-major.
  /// @return the votes of the cells whose upper left pixel lies in the tile. Their sum over all
  /// tiles is the number of votes in the view.
  std::uint64_t resolve(float* density);

  /// Finds the pixels that have votes. @return the number of votes as above.
  std::uint64_t findOccupied();
  const kernels::TilePixels& occupied() const { return occupied_; }
  /// The blocks that hold any of some pixels.
  kernels::PixelBlocks blocksOf(const kernels::TilePixels& pixels) const;
  /// Resolves the pixels of some blocks, after `findOccupied`; no vote is left.
  void resolveBlocks(const kernels::PixelBlocks& blocks, float* density);

 private:
  kernels::CellBuffer buffer() { return {cells_.data(), dirty_.data()}; }
  std::uint64_t addFullCells(float* density) const;

  const kernels::TileFunctions& scatter_;
  const kernels::ResolveFunctions& resolve_;
  PixelValues<std::uint64_t> cells_;
  PixelValues<std::uint8_t> dirty_;
  std::vector<kernels::FullCell> full_;
  std::size_t full_cells_ = 0;
  bool sparse_ = false;
  bool pending_ = false;  // votes that are not resolved
  kernels::TilePixels occupied_;
  kernels::DirtyLines dirty_lines_;
  TileCells tile_;
};

}  // namespace efm
