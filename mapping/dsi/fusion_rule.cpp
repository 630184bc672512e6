// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/dsi/fusion_rule.h"

#include <algorithm>
#include <cassert>
#include <stdexcept>

#include "mapping/kernels/fusion.h"
#include "mapping/options/named_choice.h"

namespace efm {
namespace {

constexpr NamedChoice<FusionRule> kRules[] = {
    {FusionRule::kMin, "min"},
    {FusionRule::kHarmonic, "harmonic"},
    {FusionRule::kGeometric, "geometric"},
    {FusionRule::kArithmetic, "arithmetic"},
    {FusionRule::kRms, "rms"},
    {FusionRule::kMax, "max"},
};

/// The rule's arithmetic: the only place that chooses between rules.
const kernels::FusionSteps& stepsOf(FusionRule rule, const kernels::FusionFunctions& functions) {
  switch (rule) {
    case FusionRule::kMin:
      return functions.min;
    case FusionRule::kHarmonic:
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

}  // namespace

std::string_view nameOf(FusionRule rule) { return nameIn(kRules, rule); }
FusionRule fusionRuleFromName(std::string_view name) { return valueIn(kRules, name); }

bool isAndLike(FusionRule rule) {
  return rule == FusionRule::kMin || rule == FusionRule::kHarmonic ||
         rule == FusionRule::kGeometric;
}

const std::vector<FusionRule>& allFusionRules() {
  static const std::vector<FusionRule> rules = [] {
    std::vector<FusionRule> all;
    for (const auto& choice : kRules) all.push_back(choice.value);
    return all;
  }();
  return rules;
}

FusionAccumulator::FusionAccumulator(FusionRule rule, std::size_t voxels, VotingKernel kernel)
    : steps_(&stepsOf(rule, kernels::fusionFunctions(kernel))), values_(voxels) {}

void FusionAccumulator::begin(int inputs) {
  inputs_ = inputs;
  folded_ = 0;
}

void FusionAccumulator::fold(const float* values) {
  assert(folded_ < inputs_);
  const bool first = folded_++ == 0;
  if (inputs_ <= 2) {
    // One input is its own mean, and two have a mean without a sum in between.
    if (!first) {
      steps_->pair(values_.data(), values, values_.size());
    } else if (values != values_.data()) {
      std::copy_n(values, values_.size(), values_.begin());
    }
    return;
  }
  if (first) std::fill(values_.begin(), values_.end(), steps_->start);
  steps_->fold(values_.data(), values, values_.size());
}

void FusionAccumulator::finish() {
  assert(folded_ == inputs_);
  if (inputs_ == 0) std::fill(values_.begin(), values_.end(), 0.0F);
  if (inputs_ > 2) {
    steps_->finish(values_.data(), static_cast<float>(inputs_), values_.size());
  }
}

void FusionAccumulator::addPair(const float* second, const kernels::PixelBlocks& blocks,
                                PlaneValues& sum) const {
  steps_->addPair(sum.data(), values_.data(), second, blocks);
}

}  // namespace efm
