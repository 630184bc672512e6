// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/plane_fusion.h"

#include <cassert>

#include "mapping/named_choice.h"

namespace efm {
namespace {

constexpr NamedChoice<FusionOrder> kOrders[] = {
    {FusionOrder::kCamerasThenTime, "cameras_then_time"},
    {FusionOrder::kTimeThenCameras, "time_then_cameras"},
};

/// An axis of one input needs no accumulator.
std::size_t voxelsFor(int inputs, std::size_t voxels) { return inputs > 1 ? voxels : 0; }

}  // namespace

std::string_view nameOf(FusionOrder order) { return nameIn(kOrders, order); }
FusionOrder fusionOrderFromName(std::string_view name) { return valueIn(kOrders, name); }

PlaneFusion::PlaneFusion(const FusionOptions& options, int cameras, int slots, std::size_t voxels,
                         Keep keep, VotingKernel kernel)
    : cameras_first_(options.order == FusionOrder::kCamerasThenTime),
      slots_(slots),
      inner_count_(cameras_first_ ? cameras : slots),
      outer_count_(cameras_first_ ? slots : cameras),
      votes_(voxels),
      inner_(cameras_first_ ? options.across_cameras : options.across_time,
             voxelsFor(inner_count_, voxels), kernel),
      outer_(cameras_first_ ? options.across_time : options.across_cameras,
             voxelsFor(outer_count_, voxels), kernel) {
  assert(cameras >= 1 && slots >= 1);
  if (keep == Keep::kCameras) {
    cameras_.assign(static_cast<std::size_t>(cameras),
                    FusionAccumulator(options.across_time, voxels, kernel));
  }
}

const PlaneValues& PlaneFusion::fuseInner(int outer, const Vote& vote) {
  inner_.begin(inner_count_);
  for (int inner = 0; inner < inner_count_; ++inner) {
    const int camera = cameras_first_ ? inner : outer;
    PlaneValues& votes = inner_count_ == 2 && inner == 0 ? inner_.place() : votes_;
    vote(camera, cameras_first_ ? outer : inner, votes);
    if (!cameras_.empty()) cameras_[static_cast<std::size_t>(camera)].fold(votes.data());
    if (inner_count_ > 1) inner_.fold(votes.data());
  }
  if (inner_count_ == 1) return votes_;
  inner_.finish();
  return inner_.values();
}

const PlaneValues& PlaneFusion::fuse(const Vote& vote) {
  for (FusionAccumulator& camera : cameras_) camera.begin(slots_);
  const PlaneValues* fused = nullptr;
  if (outer_count_ == 1) {
    fused = &fuseInner(0, vote);
  } else {
    outer_.begin(outer_count_);
    for (int outer = 0; outer < outer_count_; ++outer) {
      outer_.fold(fuseInner(outer, vote).data());
    }
    outer_.finish();
    fused = &outer_.values();
  }
  for (FusionAccumulator& camera : cameras_) camera.finish();
  return *fused;
}

}  // namespace efm
