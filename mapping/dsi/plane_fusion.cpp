// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/dsi/plane_fusion.h"

#include <algorithm>
#include <cassert>
#include <stdexcept>

#include "mapping/kernels/kernels.h"

namespace efm {

bool isAndLike(FusionRule rule) {
  return rule == FusionRule::kMin || rule == FusionRule::kHarmonic ||
         rule == FusionRule::kGeometric;
}

const std::vector<FusionRule>& allFusionRules() {
  static const std::vector<FusionRule> rules = [] {
    std::vector<FusionRule> all;
    for (const auto& choice : kNamesOf<FusionRule>) {
      if (choice.value != FusionRule::kPairs) all.push_back(choice.value);
    }
    return all;
  }();
  return rules;
}

const kernels::FusionSteps& stepsOf(FusionRule rule) {
  const kernels::FusionFunctions& functions = kernels::fusionFunctions();
  switch (rule) {
    case FusionRule::kMin:
      return functions.min;
    case FusionRule::kHarmonic:
    case FusionRule::kPairs:
      return functions.harmonic;
    case FusionRule::kGeometric:
      return functions.geometric;
    case FusionRule::kArithmetic:
      return functions.arithmetic;
    case FusionRule::kRms:
      return functions.rms;
    case FusionRule::kMax:
      return functions.max;
  }
  throw std::logic_error("a fusion rule has no arithmetic");
}

FusionAccumulator::FusionAccumulator(FusionRule rule, int inputs, std::size_t voxels,
                                     bool all_pairs)
    : steps_(&stepsOf(rule)),
      inputs_(inputs),
      pairs_(rule == FusionRule::kPairs && inputs > 2),
      all_pairs_(all_pairs),
      mean_(voxels) {
  assert(inputs >= 1);
}

PlaneValues& FusionAccumulator::next() {
  if (inputs_ <= 2 && isFirst()) return mean_;
  next_.resize(mean_.size());
  return next_;
}

void FusionAccumulator::add(const PlaneValues& values) {
  assert(values.size() == mean_.size());
  const bool first = isFirst();
  if (first) added_ = 0;
  ++added_;
  if (inputs_ <= 2) {
    // One input is its own mean. The mean of two inputs needs no sum.
    if (!first) {
      steps_->pair(mean_.data(), values.data(), mean_.size());
    } else if (&values != &mean_) {
      std::copy(values.begin(), values.end(), mean_.begin());
    }
    return;
  }
  if (pairs_) return addPairs(values, first);
  if (first) std::fill(mean_.begin(), mean_.end(), steps_->start);
  steps_->fold(mean_.data(), values.data(), mean_.size());
  if (isComplete()) steps_->finish(mean_.data(), static_cast<float>(inputs_), mean_.size());
}

namespace {

void addTo(PlaneValues& sum, const PlaneValues& values) {
  for (std::size_t i = 0; i < sum.size(); ++i) sum[i] += values[i];
}

}  // namespace

void FusionAccumulator::addPairs(const PlaneValues& values, bool first) {
  if (first) {
    kept_.clear();
    std::fill(mean_.begin(), mean_.end(), 0.0F);
  }
  for (const PlaneValues& other : kept_) {
    pair_ = other;
    steps_->pair(pair_.data(), values.data(), pair_.size());
    addTo(mean_, pair_);
  }
  if (first || all_pairs_) kept_.push_back(values);
}

namespace {

bool camerasFirst(const FusionOptions& options) {
  return options.order == FusionOrder::kCamerasThenTime;
}

/// Returns all inputs. The axis that is fused first varies fastest.
std::vector<CameraSlot> inputsInOrder(const FusionInputs& inputs, bool cameras_first) {
  std::vector<CameraSlot> all;
  for (int group = 0; group < inputs.groups; ++group) {
    const int begin = group * inputs.slots_per_group;
    for (int i = 0; i < inputs.cameras * inputs.slots_per_group; ++i) {
      all.push_back(cameras_first ? CameraSlot{i % inputs.cameras, begin + i / inputs.cameras}
                                  : CameraSlot{i / inputs.slots_per_group,
                                               begin + i % inputs.slots_per_group});
    }
  }
  return all;
}

}  // namespace

void FusionOptions::validate() const {
  requireOption(across_time != FusionRule::kPairs, "across_time", nameOf(across_time),
                "a mean: pairs are of cameras");
}

PlaneFusion::PlaneFusion(const FusionOptions& options, const FusionInputs& inputs,
                         std::size_t voxels, Keep keep)
    : groups_(inputs.groups),
      outer_count_(camerasFirst(options) ? inputs.slots_per_group : inputs.cameras),
      inputs_(inputsInOrder(inputs, camerasFirst(options))),
      inner_(camerasFirst(options) ? options.across_cameras : options.across_time,
             camerasFirst(options) ? inputs.cameras : inputs.slots_per_group, voxels,
             options.all_pairs),
      outer_(camerasFirst(options) ? options.across_time : options.across_cameras, outer_count_,
             outer_count_ > 1 ? voxels : 0, options.all_pairs),
      sum_(groups_ > 1 ? voxels : 0) {
  assert(inputs.cameras >= 1 && inputs.slots_per_group >= 1 && inputs.groups >= 1);
  if (keep == Keep::kFusedOnly) return;
  const auto cameras = static_cast<std::size_t>(inputs.cameras);
  cameras_.assign(cameras, FusionAccumulator(options.across_time, inputs.slots_per_group, voxels));
  camera_sums_.assign(cameras, PlaneValues(sum_.size()));
}

void PlaneFusion::begin() {
  std::fill(sum_.begin(), sum_.end(), 0.0F);
  for (PlaneValues& sum : camera_sums_) std::fill(sum.begin(), sum.end(), 0.0F);
}

void PlaneFusion::add(const CameraSlot& input) {
  const PlaneValues& density = inner_.next();
  if (!cameras_.empty()) {
    const auto c = static_cast<std::size_t>(input.camera);
    cameras_[c].add(density);
    if (groups_ > 1 && cameras_[c].isComplete()) addTo(camera_sums_[c], cameras_[c].mean());
  }
  inner_.add(density);
  if (!inner_.isComplete()) return;
  if (outer_count_ > 1) outer_.add(inner_.mean());
  if (groups_ > 1 && groupMean().isComplete()) addTo(sum_, groupMean().mean());
}

}  // namespace efm
