// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/dsi/plane_fusion.h"

#include <algorithm>
#include <cassert>

#include "mapping/options/named_choice.h"

namespace efm {
namespace {

constexpr NamedChoice<FusionOrder> kOrders[] = {
    {FusionOrder::kCamerasThenTime, "cameras_then_time"},
    {FusionOrder::kTimeThenCameras, "time_then_cameras"},
};

/// Whether a group is the mean of two inputs, which is zero where one of them is.
bool fusesPairs(const FusionOptions& options, const FusionInputs& inputs) {
  return inputs.cameras == 2 && inputs.slots == 1 && isAndLike(options.across_cameras);
}

/// An axis of one input needs no accumulator.
std::size_t voxelsFor(int inputs, std::size_t voxels) { return inputs > 1 ? voxels : 0; }

void addTo(PlaneValues& sum, const PlaneValues& values) {
  for (std::size_t i = 0; i < sum.size(); ++i) sum[i] += values[i];
}

}  // namespace

std::string_view nameOf(FusionOrder order) { return nameIn(kOrders, order); }
FusionOrder fusionOrderFromName(std::string_view name) { return valueIn(kOrders, name); }

PlaneFusion::PlaneFusion(const FusionOptions& options, const FusionInputs& inputs,
                         std::size_t voxels, Keep keep, VotingKernel kernel)
    : cameras_first_(options.order == FusionOrder::kCamerasThenTime),
      slots_(inputs.slots),
      groups_(inputs.groups),
      inner_count_(cameras_first_ ? inputs.cameras : inputs.slots),
      outer_count_(cameras_first_ ? inputs.slots : inputs.cameras),
      votes_(voxels),
      inner_(cameras_first_ ? options.across_cameras : options.across_time,
             voxelsFor(inner_count_, voxels), kernel),
      outer_(cameras_first_ ? options.across_time : options.across_cameras,
             voxelsFor(outer_count_, voxels), kernel),
      pairs_(keep == Keep::kFusedOnly && fusesPairs(options, inputs)),
      sum_(pairs_ ? voxels : voxelsFor(groups_, voxels)) {
  assert(inputs.cameras >= 1 && inputs.slots >= 1 && inputs.groups >= 1);
  if (keep == Keep::kFusedOnly) return;
  const auto cameras = static_cast<std::size_t>(inputs.cameras);
  cameras_.assign(cameras, FusionAccumulator(options.across_time, voxels, kernel));
  camera_sums_.assign(cameras, PlaneValues(voxelsFor(groups_, voxels)));
}

const PlaneValues& PlaneFusion::fuseInner(int group, int outer, const Vote& vote) {
  inner_.begin(inner_count_);
  for (int inner = 0; inner < inner_count_; ++inner) {
    const int camera = cameras_first_ ? inner : outer;
    const int slot = cameras_first_ ? outer : inner;
    PlaneValues& votes = inner_count_ == 2 && inner == 0 ? inner_.place() : votes_;
    vote(camera, group * slots_ + slot, votes);
    if (!cameras_.empty()) cameras_[static_cast<std::size_t>(camera)].fold(votes.data());
    if (inner_count_ > 1) inner_.fold(votes.data());
  }
  if (inner_count_ == 1) return votes_;
  inner_.finish();
  return inner_.values();
}

const PlaneValues& PlaneFusion::fuseGroup(int group, const Vote& vote) {
  for (FusionAccumulator& camera : cameras_) camera.begin(slots_);
  const PlaneValues* fused = nullptr;
  if (outer_count_ == 1) {
    fused = &fuseInner(group, 0, vote);
  } else {
    outer_.begin(outer_count_);
    for (int outer = 0; outer < outer_count_; ++outer) {
      outer_.fold(fuseInner(group, outer, vote).data());
    }
    outer_.finish();
    fused = &outer_.values();
  }
  for (FusionAccumulator& camera : cameras_) camera.finish();
  return *fused;
}

const PlaneValues& PlaneFusion::fuse(const Vote& vote) {
  if (groups_ == 1) return fuseGroup(0, vote);
  std::fill(sum_.begin(), sum_.end(), 0.0F);
  for (PlaneValues& sum : camera_sums_) std::fill(sum.begin(), sum.end(), 0.0F);
  for (int group = 0; group < groups_; ++group) {
    addTo(sum_, fuseGroup(group, vote));
    for (std::size_t c = 0; c < cameras_.size(); ++c) addTo(camera_sums_[c], cameras_[c].values());
  }
  return sum_;
}

/// Where one input has no vote the mean is zero, whatever the other has.
void PlaneFusion::addPairOfGroup(int group, const TileVote& vote) {
  FusionAccumulator& mean = cameras_first_ ? inner_ : outer_;
  TileDensity first{mean.place().data(), true};
  TileDensity second{votes_.data(), true};
  vote(0, group, first);
  vote(1, group, second);
  if (first.waiting == nullptr && second.waiting == nullptr) {
    mean.begin(2);
    mean.fold(first.values);
    mean.fold(second.values);
    mean.finish();
    addTo(sum_, mean.values());
    return;
  }
  const TileVotes& waiting = *(first.waiting != nullptr ? first.waiting : second.waiting);
  kernels::TilePixels both = waiting.found();
  if (second.waiting != nullptr) both.intersect(second.waiting->found());
  const kernels::PixelBlocks blocks = waiting.blocksOf(both);
  for (const TileDensity& density : {first, second}) {
    if (density.waiting != nullptr) density.waiting->foldSome(blocks, density.values);
  }
  mean.addPair(second.values, blocks, sum_);
}

const PlaneValues& PlaneFusion::fuse(const TileVote& vote) {
  if (!pairs_) {
    return fuse(Vote([&vote](int camera, int slot, PlaneValues& votes) {
      TileDensity density{votes.data()};
      vote(camera, slot, density);
    }));
  }
  std::fill(sum_.begin(), sum_.end(), 0.0F);
  for (int group = 0; group < groups_; ++group) addPairOfGroup(group, vote);
  return sum_;
}

}  // namespace efm
