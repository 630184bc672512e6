// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "mapping/dsi/plane_fusion.h"
#include "mapping/sweep/tile_accumulator.h"

namespace efm {

/// Votes and fuses all inputs of one tile, plane by plane.
///
/// Two cameras under an AND-like rule, whose slots are summed, have a shortcut with the same bits:
/// their cells are resolved and fused at once.
class TileFusion {
 public:
  /// @param kernel one of `availableKernels`, but not the plain one.
  TileFusion(const FusionOptions& options, const FusionInputs& inputs, PlaneFusion::Keep keep,
             VotingKernel kernel);

  void moveTo(const TileCells& tile);
  /// The fused plane, until the next call.
  /// @param rays the tile's, padded: input (camera, slot) at camera * slots * groups + slot.
  /// @param from_pixels from the plane of the rays' pixels to this one, 1/m.
  const PlaneValues& fuse(std::vector<TileRays>& rays, double from_pixels);
  /// A camera's own plane after `fuse`, where cameras are kept.
  const PlaneValues& ofCamera(int camera) const { return planes_->ofCamera(camera); }
  /// The weights of each camera's votes on all tiles and planes so far, in units.
  const std::vector<std::uint64_t>& units() const { return units_; }

 private:
  const PlaneValues& fusePairs(std::vector<TileRays>& rays, double from_pixels);

  FusionOptions options_;
  FusionInputs inputs_;
  PlaneFusion::Keep keep_;
  bool pairs_;  // whether the shortcut applies
  // The second one serves the shortcut.
  std::array<TileAccumulator, 2> accumulators_;
  std::optional<PlaneFusion> planes_;
  PlaneValues sum_, group_sum_;  // of the shortcut
  std::vector<bool> skips_;      // by slot: whether marks made it skip many pixels of this tile
  std::vector<std::uint64_t> units_;
};

}  // namespace efm
