// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/sweep/tile_fusion.h"

#include <algorithm>

namespace efm {
namespace {

/// Marks of lines with votes pay where few lines have them: with at most this number of rays per
/// pixel in one of two inputs, as long as this fraction of pixels at most is not skipped.
constexpr double kMaxMarkedRays = 1;
constexpr double kMaxMarkedPixels = 0.5;

}  // namespace

TileFusion::TileFusion(const FusionOptions& options, const FusionInputs& inputs,
                       PlaneFusion::Keep keep, VotingKernel kernel)
    : options_(options),
      inputs_(inputs),
      keep_(keep),
      pairs_(keep == PlaneFusion::Keep::kFusedOnly && inputs.cameras == 2 &&
             isAndLike(options.across_cameras) &&
             (inputs.slots_per_group == 1 || (options.across_time == FusionRule::kArithmetic &&
                                              options.order == FusionOrder::kCamerasThenTime))),
      accumulators_{TileAccumulator(kernel), TileAccumulator(kernel)},
      units_(static_cast<std::size_t>(inputs.cameras)) {}

void TileFusion::moveTo(const TileCells& tile) {
  for (TileAccumulator& accumulator : accumulators_) accumulator.moveTo(tile);
  const auto pixels = static_cast<std::size_t>(tile.tile.area());
  if (!pairs_) {
    planes_.emplace(options_, inputs_, pixels, keep_);
    return;
  }
  skips_.assign(static_cast<std::size_t>(inputs_.slots_per_group * inputs_.groups), true);
  for (PlaneValues* sum : {&sum_, &group_sum_}) {
    sum->reserve(pixels + kernels::kSumPadding);
    sum->resize(pixels);
  }
}

const PlaneValues& TileFusion::fuse(std::vector<TileRays>& rays, double from_pixels) {
  if (pairs_) return fusePairs(rays, from_pixels);
  planes_->begin();
  for (const CameraSlot& input : planes_->inputs()) {
    TileAccumulator& accumulator = accumulators_[0];
    accumulator.vote(rays[static_cast<std::size_t>(
                         input.camera * inputs_.slots_per_group * inputs_.groups + input.slot)],
                     from_pixels);
    units_[static_cast<std::size_t>(input.camera)] += accumulator.resolve(planes_->next().data());
    planes_->add(input);
  }
  return planes_->fused();
}

const PlaneValues& TileFusion::fusePairs(std::vector<TileRays>& rays, double from_pixels) {
  std::fill(sum_.begin(), sum_.end(), 0.0F);
  const auto slots_per_group = static_cast<std::size_t>(inputs_.slots_per_group);
  const std::size_t slots = rays.size() / 2;
  for (std::size_t begin = 0; begin < slots; begin += slots_per_group) {
    PlaneValues& sum = slots_per_group == 1 ? sum_ : group_sum_;
    if (slots_per_group > 1) std::fill(sum.begin(), sum.end(), 0.0F);
    for (std::size_t slot = begin; slot < begin + slots_per_group; ++slot) {
      TileRays& first = rays[slot];
      TileRays& second = rays[slots + slot];
      const auto fewer = static_cast<double>(std::min(first.size(), second.size()));
      const auto pixels = static_cast<double>(sum.size());
      const bool marks = skips_[slot] && fewer <= kMaxMarkedRays * pixels;
      accumulators_[0].vote(first, from_pixels, marks);
      accumulators_[1].vote(second, from_pixels, marks);
      const int resolved = TileAccumulator::addPair(options_.across_cameras, accumulators_[0],
                                                    accumulators_[1], sum.data(), units_.data());
      if (marks) skips_[slot] = resolved <= kMaxMarkedPixels * pixels;
    }
    if (slots_per_group == 1) continue;
    const auto count = static_cast<float>(slots_per_group);
    for (std::size_t i = 0; i < sum_.size(); ++i) sum_[i] += sum[i] / count;
  }
  return sum_;
}

}  // namespace efm
