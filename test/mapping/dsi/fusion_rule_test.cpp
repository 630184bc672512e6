// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/dsi/plane_fusion.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

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

/// The mean of one input each, which every voxel of a plane must have, bit for bit.
/// @param in_place whether inputs are written to `next`.
float meanOf(FusionRule rule, const std::vector<float>& inputs, bool in_place) {
  constexpr std::size_t kVoxels = 37;  // full vectors of any instruction set, and a rest
  FusionAccumulator accumulator(rule, static_cast<int>(inputs.size()), kVoxels);
  for (const float input : inputs) {
    PlaneValues own(kVoxels);
    PlaneValues& plane = in_place ? accumulator.next() : own;
    std::fill(plane.begin(), plane.end(), input);
    accumulator.add(plane);
  }
  EXPECT_TRUE(accumulator.isComplete());
  const PlaneValues& values = accumulator.mean();
  const bool same = std::all_of(values.begin(), values.end(),
                                [&](float value) { return value == values.front(); });
  return same ? values.front() : std::numeric_limits<float>::quiet_NaN();
}

/// Adding n floats errs by at most n roundings, log and exp by a few more: 16 inputs of up to
/// log 4000 = 8.3 summed and exponentiated stay within 16 * 16 * 8.3 * 6e-8 = 1.3e-4.
constexpr double kMeanRounding = 2e-4;

RC_GTEST_PROP(FusionRule, EveryRuleIsItsTextbookMean, ()) {
  const auto inputs = *densities();
  const std::vector<double> exact(inputs.begin(), inputs.end());
  for (const FusionRule rule : allFusionRules()) {
    const double expected = oracle::fuse(rule, exact);
    RC_ASSERT(std::abs(meanOf(rule, inputs, false) - expected) <= kMeanRounding * expected);
    RC_ASSERT(meanOf(rule, inputs, true) == meanOf(rule, inputs, false));
  }
}

TEST(FusionRule, AZeroInputSilencesTheAndLikeRulesOnly) {
  for (const FusionRule rule : allFusionRules()) {
    EXPECT_EQ(isAndLike(rule), rule <= FusionRule::kGeometric);
    for (const std::vector<float>& inputs : {std::vector<float>{0.0F, 8.0F, 3.0F}, {8.0F, 0.0F}}) {
      EXPECT_EQ(meanOf(rule, inputs, false) == 0, isAndLike(rule)) << nameOf(rule);
    }
  }
}

TEST(FusionRule, OneInputIsItselfBitForBitAndTheNextMeanForgetsIt) {
  for (const FusionRule rule : allFusionRules()) {
    EXPECT_EQ(meanOf(rule, {0.3F}, false), 0.3F) << nameOf(rule);
    for (const int inputs : {1, 2, 3}) {
      FusionAccumulator accumulator(rule, inputs, 1);
      for (const float value : {9.0F, 4.0F}) {
        for (int i = 0; i < inputs; ++i) accumulator.add({value});
        EXPECT_NEAR(accumulator.mean()[0], value, 1e-5) << nameOf(rule) << " of " << inputs;
      }
    }
  }
}

}  // namespace
}  // namespace efm
