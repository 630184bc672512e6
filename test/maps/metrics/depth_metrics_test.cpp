// SPDX-License-Identifier: BSD-3-Clause
#include "maps/metrics/depth_metrics.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <cmath>

namespace efm {
namespace {

TEST(DepthErrors, AreWorkedOutByHand) {
  // |Z - Z_true| = 0, 1/6, 1, 1; |1/Z - 1/Z_true| = 0, 1/2, 1/2, 1/12.
  const DepthErrors errors = depthErrors({{2, 2}, {0.5, 1.0 / 1.5}, {2, 1}, {4, 3}});
  EXPECT_EQ(errors.points, 4U);
  EXPECT_NEAR(errors.mean_abs_m, (0 + 1.0 / 6 + 1 + 1) / 4, 1e-15);
  EXPECT_NEAR(errors.median_abs_m, (1.0 / 6 + 1) / 2, 1e-15);
  EXPECT_NEAR(errors.median_inverse, (1.0 / 12 + 0.5) / 2, 1e-15);
  EXPECT_FALSE(errors.bad_pix_5px.has_value());
}

TEST(DepthErrors, BadPixelsExceedTheLimitInPixelsAndFivePercent) {
  // f * b = 100, so disparity = 100 / Z.
  const std::vector<DepthPair> pairs = {
      {100.0 / 50, 100.0 / 50},    // exact
      {100.0 / 54, 100.0 / 50},    // 4 px, 8 %: bad for 3 px only
      {100.0 / 56, 100.0 / 50},    // 6 px, 12 %: bad for both
      {100.0 / 206, 100.0 / 200},  // 6 px, 3 %: good for both
  };

  const DepthErrors errors = depthErrors(pairs, 100.0);

  EXPECT_DOUBLE_EQ(errors.bad_pix_5px.value(), 0.25);
  EXPECT_DOUBLE_EQ(errors.bad_pix_3px.value(), 0.5);
}

TEST(DepthErrors, LogarithmicOnesAreWorkedOutByHand) {
  // d = ln 2, 0, -ln 2, ln 2: mean ln 2 / 4, mean of squares 3/4 ln^2 2.
  const DepthErrors errors = depthErrors({{2, 1}, {3, 3}, {1, 2}, {4, 2}});
  const double ln2 = std::log(2.0);
  EXPECT_NEAR(errors.silog, 100 * (0.75 - 0.0625) * ln2 * ln2, 1e-12);
  EXPECT_NEAR(errors.log_rmse, 100 * std::sqrt(0.75) * ln2, 1e-12);
}

TEST(DepthErrors, RelativeOnesAreWorkedOutByHand) {
  // |Z - Z_true| = 1, 0, 1, 2; over the truth 1, 0, 1/2, 1; over the estimate 1/2, 0, 1, 1/2.
  const DepthErrors errors = depthErrors({{2, 1}, {3, 3}, {1, 2}, {4, 2}});
  EXPECT_NEAR(errors.aerrr, 2.5 / 4, 1e-15);
  EXPECT_NEAR(errors.aerrr_by_estimate, 2.0 / 4, 1e-15);
  EXPECT_EQ(errors.beyond_tenth, 0.75);
}

TEST(DepthErrors, DeltaCountsRatiosUnderPowersOfFiveFourths) {
  // Ratios, either way up: 1.2, 1.25 (not under 1.25), 1.5, 1.9, 2.
  const DepthErrors errors = depthErrors({{1.2, 1}, {1, 1.25}, {1.5, 1}, {1, 1.9}, {2, 1}});
  EXPECT_DOUBLE_EQ(errors.delta[0], 1.0 / 5);
  EXPECT_DOUBLE_EQ(errors.delta[1], 3.0 / 5);
  EXPECT_DOUBLE_EQ(errors.delta[2], 4.0 / 5);
}

TEST(DepthErrors, OfNoPointsAreZero) {
  const DepthErrors errors = depthErrors({}, 100.0);
  EXPECT_EQ(errors.points, 0U);
  EXPECT_EQ(errors.mean_abs_m, 0);
  EXPECT_EQ(errors.median_abs_m, 0);
  EXPECT_EQ(errors.bad_pix_3px.value(), 0);
  EXPECT_EQ(errors.silog, 0);
  EXPECT_EQ(errors.delta[0], 0);
}

TEST(DepthErrors, DisparityNeedsAFocalLengthTimesBaselineAboveZero) {
  EXPECT_THROW(depthErrors({{1, 1}}, 0.0), std::invalid_argument);
  EXPECT_THROW(depthErrors({{1, 1}}, std::nan("")), std::invalid_argument);
}

TEST(DepthErrors, MeanOverMapsCountsEachMapTheSameAndEmptyOnesNot) {
  const DepthErrors a = depthErrors({{2, 1}}, 10.0);
  const DepthErrors b = depthErrors({{4, 1}, {4, 1}, {4, 1}}, 10.0);
  const DepthErrors mean = meanOfErrors({a, depthErrors({}, 10.0), b});
  EXPECT_EQ(mean.points, 4U);
  EXPECT_EQ(mean.mean_abs_m, 2);
  EXPECT_EQ(mean.median_abs_m, 2);
  EXPECT_EQ(mean.aerrr, 2);
  EXPECT_EQ(mean.bad_pix_3px, 1);
  EXPECT_NEAR(mean.log_rmse, 150 * std::log(2.0), 1e-12);
  EXPECT_FALSE(meanOfErrors({a, depthErrors({{1, 1}})}).bad_pix_3px.has_value());
  EXPECT_EQ(meanOfErrors({}).points, 0U);
}

RC_GTEST_PROP(DepthErrors, ScaleWithTheWorldAndInverseDepthAgainstIt, ()) {
  // Scaling the world by s scales depth errors by s and inverse depth errors by 1/s.
  const auto drawn = *rc::gen::nonEmpty(rc::gen::container<std::vector<std::pair<int, int>>>(
      rc::gen::pair(rc::gen::inRange(1, 1000), rc::gen::inRange(1, 1000))));
  std::vector<DepthPair> pairs;
  std::vector<DepthPair> scaled;
  for (const auto& [estimate, truth] : drawn) {
    pairs.push_back({estimate * 0.01, truth * 0.01});
    scaled.push_back({estimate * 0.04, truth * 0.04});
  }
  const DepthErrors a = depthErrors(pairs, 10.0);
  const DepthErrors b = depthErrors(scaled, 40.0);

  RC_ASSERT(std::abs(b.mean_abs_m - 4 * a.mean_abs_m) < 1e-9);
  RC_ASSERT(std::abs(b.median_abs_m - 4 * a.median_abs_m) < 1e-9);
  RC_ASSERT(std::abs(4 * b.median_inverse - a.median_inverse) < 1e-9);
  RC_ASSERT(a.bad_pix_5px.value() <= a.bad_pix_3px.value());
  // What is relative does not see the scale of the world.
  RC_ASSERT(std::abs(b.silog - a.silog) < 1e-9);
  RC_ASSERT(std::abs(b.log_rmse - a.log_rmse) < 1e-9);
  RC_ASSERT(std::abs(b.aerrr - a.aerrr) < 1e-9);
  RC_ASSERT(std::abs(b.aerrr_by_estimate - a.aerrr_by_estimate) < 1e-9);
}

RC_GTEST_PROP(DepthErrors, SilogDoesNotSeeTheScaleOfTheEstimateAloneAndTheRestDoes, ()) {
  const auto drawn = *rc::gen::nonEmpty(rc::gen::container<std::vector<std::pair<int, int>>>(
      rc::gen::pair(rc::gen::inRange(100, 1000), rc::gen::inRange(100, 1000))));
  std::vector<DepthPair> pairs;
  std::vector<DepthPair> scaled;
  for (const auto& [estimate, truth] : drawn) {
    pairs.push_back({estimate * 0.01, truth * 0.01});
    scaled.push_back({estimate * 1.0, truth * 0.01});
  }
  const DepthErrors a = depthErrors(pairs);
  const DepthErrors b = depthErrors(scaled);
  RC_ASSERT(std::abs(b.silog - a.silog) < 1e-8);
  RC_ASSERT(b.log_rmse > a.log_rmse);
  RC_ASSERT(b.aerrr > a.aerrr);
}

RC_GTEST_PROP(DepthErrors, SwappingEstimateAndTruthLeavesTheLogarithmicOnes, ()) {
  const auto drawn = *rc::gen::nonEmpty(rc::gen::container<std::vector<std::pair<int, int>>>(
      rc::gen::pair(rc::gen::inRange(1, 1000), rc::gen::inRange(1, 1000))));
  std::vector<DepthPair> pairs;
  std::vector<DepthPair> swapped;
  for (const auto& [estimate, truth] : drawn) {
    pairs.push_back({estimate * 0.01, truth * 0.01});
    swapped.push_back({truth * 0.01, estimate * 0.01});
  }
  const DepthErrors a = depthErrors(pairs);
  const DepthErrors b = depthErrors(swapped);
  RC_ASSERT(std::abs(a.silog - b.silog) < 1e-9 * (1 + a.silog));
  RC_ASSERT(std::abs(a.log_rmse - b.log_rmse) < 1e-9 * (1 + a.log_rmse));
  RC_ASSERT(std::abs(a.aerrr - b.aerrr_by_estimate) < 1e-9 * (1 + a.aerrr));
  RC_ASSERT(a.delta == b.delta);
  RC_ASSERT(a.delta[0] <= a.delta[1]);
  RC_ASSERT(a.delta[1] <= a.delta[2]);
}

}  // namespace
}  // namespace efm
