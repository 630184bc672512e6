// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/fusion_rule.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "mapping/named_choice.h"

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

constexpr float kInfinity = std::numeric_limits<float>::infinity();

// A rule is three small functions: what the sum starts from, how an input joins it, and what the
// sum of n inputs means. Zeros need no branch: IEEE arithmetic carries 1/0 and log 0 to a mean of
// zero.

struct Min {
  static constexpr float kStart = kInfinity;
  static float fold(float sum, float value) { return std::min(sum, value); }
  static float finish(float sum, float) { return sum; }
};

struct Harmonic {
  static constexpr float kStart = 0;
  static float fold(float sum, float value) { return sum + 1.0F / value; }
  static float finish(float sum, float inputs) { return inputs / sum; }
};

struct Geometric {
  static constexpr float kStart = 0;
  static float fold(float sum, float value) { return sum + std::log(value); }
  static float finish(float sum, float inputs) { return std::exp(sum / inputs); }
};

struct Arithmetic {
  static constexpr float kStart = 0;
  static float fold(float sum, float value) { return sum + value; }
  static float finish(float sum, float inputs) { return sum / inputs; }
};

struct Rms {
  static constexpr float kStart = 0;
  static float fold(float sum, float value) { return sum + value * value; }
  static float finish(float sum, float inputs) { return std::sqrt(sum / inputs); }
};

struct Max {
  static constexpr float kStart = 0;
  static float fold(float sum, float value) { return std::max(sum, value); }
  static float finish(float sum, float) { return sum; }
};

/// Calls `visitor` with the rule's functions: the only place that chooses between rules.
template <typename Visitor>
void visitRule(FusionRule rule, const Visitor& visitor) {
  switch (rule) {
    case FusionRule::kMin:
      return visitor(Min());
    case FusionRule::kHarmonic:
      return visitor(Harmonic());
    case FusionRule::kGeometric:
      return visitor(Geometric());
    case FusionRule::kArithmetic:
      return visitor(Arithmetic());
    case FusionRule::kRms:
      return visitor(Rms());
    case FusionRule::kMax:
      return visitor(Max());
  }
}

}  // namespace

std::string_view nameOf(FusionRule rule) { return nameIn(kRules, rule); }
FusionRule fusionRuleFromName(std::string_view name) { return valueIn(kRules, name); }

const std::vector<FusionRule>& allFusionRules() {
  static const std::vector<FusionRule> rules = [] {
    std::vector<FusionRule> all;
    for (const auto& choice : kRules) all.push_back(choice.value);
    return all;
  }();
  return rules;
}

FusionAccumulator::FusionAccumulator(FusionRule rule, std::size_t voxels)
    : rule_(rule), values_(voxels) {}

void FusionAccumulator::begin() {
  inputs_ = 0;
  visitRule(rule_, [this](auto functions) {
    std::fill(values_.begin(), values_.end(), decltype(functions)::kStart);
  });
}

void FusionAccumulator::fold(const float* values) {
  ++inputs_;
  visitRule(rule_, [this, values](auto functions) {
    for (std::size_t i = 0; i < values_.size(); ++i) {
      values_[i] = decltype(functions)::fold(values_[i], values[i]);
    }
  });
}

void FusionAccumulator::finish() {
  if (inputs_ == 0) {
    std::fill(values_.begin(), values_.end(), 0.0F);
    return;
  }
  const auto inputs = static_cast<float>(inputs_);
  visitRule(rule_, [this, inputs](auto functions) {
    for (float& value : values_) value = decltype(functions)::finish(value, inputs);
  });
}

}  // namespace efm
