// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/dsi/fusion_rule.h"

#include <algorithm>
#include <cassert>
#include <stdexcept>

#include "mapping/base/named_choice.h"
#include "mapping/kernels/fusion.h"

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

const kernels::FusionSteps& stepsOf(FusionRule rule) {
  const kernels::FusionFunctions& functions = kernels::fusionFunctions();
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

FusionAccumulator::FusionAccumulator(FusionRule rule, int inputs, std::size_t voxels)
    : steps_(&stepsOf(rule)), inputs_(inputs), mean_(voxels) {
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
    // One input is its own mean, and two have a mean without a sum in between.
    if (!first) {
      steps_->pair(mean_.data(), values.data(), mean_.size());
    } else if (&values != &mean_) {
      std::copy(values.begin(), values.end(), mean_.begin());
    }
    return;
  }
  if (first) std::fill(mean_.begin(), mean_.end(), steps_->start);
  steps_->fold(mean_.data(), values.data(), mean_.size());
  if (isComplete()) steps_->finish(mean_.data(), static_cast<float>(inputs_), mean_.size());
}

}  // namespace efm
