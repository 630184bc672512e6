// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/sweep/tile_fusion.h"

#include <algorithm>

#include "mapping/kernels/fusion.h"

namespace efm {

TileFusion::TileFusion(const FusionOptions& options, const FusionInputs& inputs,
                       PlaneFusion::Keep keep, VotingKernel kernel)
    : options_(options),
      inputs_(inputs),
      keep_(keep),
      pairs_(keep == PlaneFusion::Keep::kFusedOnly && inputs.cameras == 2 &&
             inputs.slots_per_group == 1 && isAndLike(options.across_cameras)),
      accumulators_{TileAccumulator(kernel), TileAccumulator(kernel)},
      votes_(static_cast<std::size_t>(inputs.cameras)) {}

void TileFusion::moveTo(const TileCells& tile) {
  for (TileAccumulator& accumulator : accumulators_) accumulator.moveTo(tile);
  const auto pixels = static_cast<std::size_t>(tile.tile.area());
  if (!pairs_) {
    planes_.emplace(options_, inputs_, pixels, keep_);
    return;
  }
  all_pixels_.width = tile.tile.width;
  all_pixels_.height = tile.tile.height;
  std::fill_n(all_pixels_.rows, tile.tile.height, (std::uint64_t{1} << tile.tile.width) - 1);
  for (PlaneValues* values : {&first_, &second_, &sum_}) values->resize(pixels);
}

const PlaneValues& TileFusion::fuse(std::vector<TileRays>& rays, double from_first) {
  if (pairs_) return fuseOccupied(rays, from_first);
  planes_->begin();
  for (const CameraSlot& input : planes_->inputs()) {
    TileAccumulator& accumulator = accumulators_[0];
    accumulator.vote(rays[static_cast<std::size_t>(
                         input.camera * inputs_.slots_per_group * inputs_.groups + input.slot)],
                     from_first);
    votes_[static_cast<std::size_t>(input.camera)] += accumulator.resolve(planes_->next().data());
    planes_->add(input);
  }
  return planes_->fused();
}

const PlaneValues& TileFusion::fuseOccupied(std::vector<TileRays>& rays, double from_first) {
  std::fill(sum_.begin(), sum_.end(), 0.0F);
  const auto groups = static_cast<std::size_t>(inputs_.groups);
  for (std::size_t group = 0; group < groups; ++group) {
    addPair(rays[group], rays[groups + group], from_first);
  }
  return sum_;
}

/// Adds the mean of a group's two inputs where both have votes.
void TileFusion::addPair(TileRays& first_rays, TileRays& second_rays, double from_first) {
  kernels::TilePixels both = all_pixels_;
  // Many votes are resolved at once, few wait until the other input's pixels are known.
  const auto vote = [&](TileAccumulator& accumulator, TileRays& rays, PlaneValues& density) {
    accumulator.vote(rays, from_first);
    if (!accumulator.isSparse()) return accumulator.resolve(density.data());
    const std::uint64_t votes = accumulator.findOccupied();
    both.intersect(accumulator.occupied());
    return votes;
  };
  TileAccumulator& first = accumulators_[0];
  votes_[0] += vote(first, first_rays, first_);
  const bool first_waits = first.isSparse();
  // The first accumulator is in the cache: it serves both inputs where its own votes are resolved.
  TileAccumulator& second = accumulators_[first_waits ? 1 : 0];
  votes_[1] += vote(second, second_rays, second_);
  const kernels::PixelBlocks blocks = first.blocksOf(both);
  if (first_waits) first.resolveBlocks(blocks, first_.data());
  if (second.isSparse()) second.resolveBlocks(blocks, second_.data());
  stepsOf(options_.across_cameras).addPair(sum_.data(), first_.data(), second_.data(), blocks);
}

}  // namespace efm
