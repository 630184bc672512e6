// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "mapping/dsi/fusion_rule.h"
#include "mapping/dsi/plane_values.h"
#include "mapping/dsi/voting_kernel.h"
#include "mapping/kernels/tile_resolve.h"
#include "mapping/kernels/tile_scatter.h"
#include "mapping/sweep/tile_rays.h"

namespace efm {

/// Sums the votes of one input on one tile of a plane in cells (`kernels/tile_scatter.h`) and
/// resolves them into ray densities.
///
/// Use: `vote`; then `resolve`, or `addPair` with another input.
class TileAccumulator {
 public:
  /// @param kernel one of `availableKernels`, but not the plain one.
  explicit TileAccumulator(VotingKernel kernel);

  /// Moves to a tile. No votes are pending (asserted).
  void moveTo(const TileCells& tile);

  /// Votes with the tile's rays on one plane.
  /// @param rays padded. @param from_pixels from the plane of the rays' pixels to this one, 1/m.
  /// @param marks whether lines of cells with votes are marked, for `addPair`: it pays where few
  /// cells have votes. Both inputs must be alike.
  void vote(TileRays& rays, double from_pixels, bool marks = false);
  /// Resolves all pixels; no vote is left.
  /// @param density one value per pixel of the tile, row-major.
  /// @return the sum of all pixels' weights, in units. All tiles together have
  /// 2^kernels::kWeightBits units for each vote in the view.
  std::uint64_t resolve(float* density);

  /// Adds the mean of two inputs on the same tile to a sum; no vote is left. The bits are those of
  /// `resolve` and the rule's mean.
  /// @param rule AND-like. @param sum as `density`, and kernels::kSumPadding. @param units receives
  /// those of each input, added. @return the number of pixels that were not skipped.
  static int addPair(FusionRule rule, TileAccumulator& first, TileAccumulator& second, float* sum,
                     std::uint64_t units[2]);

 private:
  kernels::CellBuffer buffer() { return {cells_.data(), marked_ ? dirty_.data() : nullptr}; }
  std::uint64_t addFullCells(float* density) const;

  const kernels::TileFunctions& scatter_;
  const kernels::ResolveFunctions& resolve_;
  PixelValues<std::uint64_t> cells_;
  PixelValues<std::uint8_t> dirty_;
  std::vector<kernels::FullCell> full_;
  std::size_t full_cells_ = 0;
  PlaneValues density_;   // of a pair with full cells
  bool pending_ = false;  // votes that are not resolved
  bool marked_ = false;   // whether they are marked
  TileCells tile_;
};

}  // namespace efm
