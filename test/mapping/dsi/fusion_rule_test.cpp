// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/dsi/fusion_rule.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>

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

/// Full vectors of any instruction set, and a rest.
constexpr std::size_t kVoxels = 37;

/// The mean of one input each, which every voxel of a plane must have, bit for bit.
float fuse(VotingKernel kernel, FusionRule rule, const std::vector<float>& inputs) {
  FusionAccumulator accumulator(rule, kVoxels, kernel);
  accumulator.begin(static_cast<int>(inputs.size()));
  for (const float input : inputs) accumulator.fold(std::vector<float>(kVoxels, input).data());
  accumulator.finish();
  const PlaneValues& values = accumulator.values();
  const bool same = std::all_of(values.begin(), values.end(),
                                [&](float value) { return value == values.front(); });
  return same ? values.front() : std::numeric_limits<float>::quiet_NaN();
}

/// Folding n floats errs by at most n roundings, log and exp by a few more: 16 inputs of up to
/// log 4000 = 8.3 summed and exponentiated stay within 16 * 16 * 8.3 * 6e-8 = 1.3e-4.
constexpr double kRounding = 2e-4;

/// Calls with every kernel that runs here and every rule.
template <typename Check>
void forEachKernelAndRule(const Check& check) {
  for (const VotingKernel kernel : availableKernels()) {
    for (const FusionRule rule : allFusionRules()) check(kernel, rule);
  }
}

std::string labelOf(VotingKernel kernel, FusionRule rule) {
  return std::string(nameOf(kernel)) + ", " + std::string(nameOf(rule));
}

RC_GTEST_PROP(FusionRule, EveryRuleIsItsTextbookMean, ()) {
  const auto inputs = *densities();
  const std::vector<double> exact(inputs.begin(), inputs.end());
  forEachKernelAndRule([&](VotingKernel kernel, FusionRule rule) {
    const double expected = oracle::fuse(rule, exact);
    RC_ASSERT(std::abs(fuse(kernel, rule, inputs) - expected) <= kRounding * expected);
  });
}

RC_GTEST_PROP(FusionRule, MeansAreOrdered, ()) {
  const auto inputs = *densities();
  for (const VotingKernel kernel : availableKernels()) {
    double previous = 0;
    for (const FusionRule rule : allFusionRules()) {  // from min to max (the paper's Eq. 12)
      const double mean = fuse(kernel, rule, inputs);
      RC_ASSERT(mean >= previous * (1 - kRounding));
      previous = mean;
    }
  }
}

RC_GTEST_PROP(FusionRule, TheOrderOfInputsDoesNotMatter, ()) {
  const auto inputs = *densities();
  auto reversed = inputs;
  std::reverse(reversed.begin(), reversed.end());
  forEachKernelAndRule([&](VotingKernel kernel, FusionRule rule) {
    const double mean = fuse(kernel, rule, inputs);
    RC_ASSERT(std::abs(fuse(kernel, rule, reversed) - mean) <= kRounding * mean);
  });
}

RC_GTEST_PROP(FusionRule, EqualInputsAreTheirOwnMean, ()) {
  const std::vector<float> inputs(*rc::gen::inRange<std::size_t>(1, 17), *density());
  forEachKernelAndRule([&](VotingKernel kernel, FusionRule rule) {
    const double mean = fuse(kernel, rule, inputs);
    RC_ASSERT(std::abs(mean - inputs.front()) <= kRounding * inputs.front());
  });
}

TEST(FusionRule, AZeroInputSilencesTheAndLikeRulesOnly) {
  forEachKernelAndRule([](VotingKernel kernel, FusionRule rule) {
    for (const std::vector<float>& inputs : {std::vector<float>{0.0F, 8.0F, 3.0F}, {8.0F, 0.0F}}) {
      if (rule <= FusionRule::kGeometric) {
        EXPECT_EQ(fuse(kernel, rule, inputs), 0.0F) << labelOf(kernel, rule);
      } else {
        EXPECT_GT(fuse(kernel, rule, inputs), 0.0F) << labelOf(kernel, rule);
      }
    }
  });
}

TEST(FusionRule, TheThirdInputCounts) {
  forEachKernelAndRule([](VotingKernel kernel, FusionRule rule) {
    EXPECT_NE(fuse(kernel, rule, {4.0F, 6.0F, 1.0F}), fuse(kernel, rule, {4.0F, 6.0F, 9.0F}))
        << labelOf(kernel, rule);
  });
}

TEST(FusionRule, OneInputIsItselfBitForBit) {
  forEachKernelAndRule([](VotingKernel kernel, FusionRule rule) {
    EXPECT_EQ(fuse(kernel, rule, {0.3F}), 0.3F) << labelOf(kernel, rule);
  });
}

TEST(FusionRule, NoInputMeansZero) {
  forEachKernelAndRule([](VotingKernel kernel, FusionRule rule) {
    EXPECT_EQ(fuse(kernel, rule, {}), 0.0F) << labelOf(kernel, rule);
  });
}

TEST(FusionRule, NamesGoBothWays) {
  for (const FusionRule rule : allFusionRules()) EXPECT_EQ(fusionRuleFromName(nameOf(rule)), rule);
  EXPECT_THAT([] { fusionRuleFromName("median"); },
              ::testing::ThrowsMessage<std::invalid_argument>(::testing::AllOf(
                  ::testing::HasSubstr("'median'"), ::testing::HasSubstr("harmonic"))));
}

}  // namespace
}  // namespace efm
