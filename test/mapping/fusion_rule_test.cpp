// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/fusion_rule.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <stdexcept>

#include "test/oracle/naive_mapper.h"

namespace efm {
namespace {

/// Ray densities as votes make them: not negative, some zero, up to a few thousand.
rc::Gen<float> density() {
  return rc::gen::oneOf(rc::gen::just(0.0F),
                        rc::gen::map(rc::gen::inRange(1, 4'000'000),
                                     [](int n) { return static_cast<float>(n) * 1e-3F; }));
}

rc::Gen<std::vector<float>> densities() {
  return rc::gen::mapcat(rc::gen::inRange<std::size_t>(1, 17), [](std::size_t n) {
    return rc::gen::container<std::vector<float>>(n, density());
  });
}

float fuse(FusionRule rule, const std::vector<float>& inputs) {
  FusionAccumulator accumulator(rule, 1);
  accumulator.begin();
  for (const float& input : inputs) accumulator.fold(&input);
  accumulator.finish();
  return accumulator.values().front();
}

/// Folding n floats errs by at most n roundings, log and exp by a few more: 16 inputs of up to
/// log 4000 = 8.3 summed and exponentiated stay within 16 * 16 * 8.3 * 6e-8 = 1.3e-4.
constexpr double kRounding = 2e-4;

RC_GTEST_PROP(FusionRule, EveryRuleIsItsTextbookMean, ()) {
  const auto inputs = *densities();
  const std::vector<double> exact(inputs.begin(), inputs.end());
  for (const FusionRule rule : allFusionRules()) {
    const double expected = oracle::fuse(rule, exact);
    RC_ASSERT(std::abs(fuse(rule, inputs) - expected) <= kRounding * expected);
  }
}

RC_GTEST_PROP(FusionRule, MeansAreOrdered, ()) {
  const auto inputs = *densities();
  double previous = 0;
  for (const FusionRule rule : allFusionRules()) {  // from min to max (the paper's Eq. 12)
    const double mean = fuse(rule, inputs);
    RC_ASSERT(mean >= previous * (1 - kRounding));
    previous = mean;
  }
}

RC_GTEST_PROP(FusionRule, TheOrderOfInputsDoesNotMatter, ()) {
  auto inputs = *densities();
  for (const FusionRule rule : allFusionRules()) {
    const double mean = fuse(rule, inputs);
    auto reversed = inputs;
    std::reverse(reversed.begin(), reversed.end());
    RC_ASSERT(std::abs(fuse(rule, reversed) - mean) <= kRounding * mean);
  }
}

RC_GTEST_PROP(FusionRule, EqualInputsAreTheirOwnMean, ()) {
  const std::vector<float> inputs(*rc::gen::inRange<std::size_t>(1, 17), *density());
  for (const FusionRule rule : allFusionRules()) {
    RC_ASSERT(std::abs(fuse(rule, inputs) - inputs.front()) <= kRounding * inputs.front());
  }
}

TEST(FusionRule, AZeroInputSilencesTheAndLikeRulesOnly) {
  const std::vector<float> inputs = {0.0F, 8.0F, 3.0F};
  for (const FusionRule rule : {FusionRule::kMin, FusionRule::kHarmonic, FusionRule::kGeometric}) {
    EXPECT_EQ(fuse(rule, inputs), 0.0F) << nameOf(rule);
  }
  for (const FusionRule rule : {FusionRule::kArithmetic, FusionRule::kRms, FusionRule::kMax}) {
    EXPECT_GT(fuse(rule, inputs), 0.0F) << nameOf(rule);
  }
}

TEST(FusionRule, TheThirdInputCounts) {
  for (const FusionRule rule : allFusionRules()) {
    EXPECT_NE(fuse(rule, {4.0F, 6.0F, 1.0F}), fuse(rule, {4.0F, 6.0F, 9.0F})) << nameOf(rule);
  }
}

TEST(FusionRule, NoInputMeansZero) {
  for (const FusionRule rule : allFusionRules()) EXPECT_EQ(fuse(rule, {}), 0.0F) << nameOf(rule);
}

TEST(FusionRule, NamesGoBothWays) {
  for (const FusionRule rule : allFusionRules()) EXPECT_EQ(fusionRuleFromName(nameOf(rule)), rule);
  EXPECT_THAT([] { fusionRuleFromName("median"); },
              ::testing::ThrowsMessage<std::invalid_argument>(::testing::AllOf(
                  ::testing::HasSubstr("'median'"), ::testing::HasSubstr("harmonic"))));
}

}  // namespace
}  // namespace efm
