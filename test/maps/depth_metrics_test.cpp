// SPDX-License-Identifier: BSD-3-Clause
#include "maps/depth_metrics.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <cmath>

namespace efm {
namespace {

TEST(PairDepths, PixelsWithoutAnEstimateOrATruthAreLeftOut) {
  const float nan = std::nanf("");
  const cv::Mat1f estimate = (cv::Mat1f(1, 5) << 1, 0, 2, nan, 3);
  const cv::Mat1f truth = (cv::Mat1f(1, 5) << 1, 1, 0, 1, INFINITY);

  const std::vector<DepthPair> pairs = pairDepths(estimate, truth);

  ASSERT_EQ(pairs.size(), 1U);
  EXPECT_EQ(pairs[0].estimate_m, 1);
  EXPECT_EQ(pairs[0].truth_m, 1);
}

TEST(PairDepths, TruthFartherThanTheLimitCountsAsNone) {
  const cv::Mat1f estimate = (cv::Mat1f(1, 2) << 2, 2);
  const cv::Mat1f truth = (cv::Mat1f(1, 2) << 5, 6);

  EXPECT_EQ(pairDepths(estimate, truth, {0, 5.0}).size(), 1U);
}

TEST(PairDepths, ToleranceTakesTheTruthNearestInInverseDepth) {
  // Around the middle pixel: 1 m and 4 m. |1/2 - 1/1| = 0.5, |1/2 - 1/4| = 0.25, although 1 m is
  // the nearer one in depth.
  const cv::Mat1f estimate = (cv::Mat1f(1, 3) << 0, 2, 0);
  const cv::Mat1f truth = (cv::Mat1f(1, 3) << 1, 9, 4);

  EXPECT_EQ(pairDepths(estimate, truth, {0})[0].truth_m, 9);
  EXPECT_EQ(pairDepths(estimate, truth, {1})[0].truth_m, 4);
}

TEST(PairDepths, MapsOfDifferentSizeAreRefused) {
  EXPECT_THROW(pairDepths(cv::Mat1f::ones(2, 3), cv::Mat1f::ones(3, 2)), std::invalid_argument);
}

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

TEST(DepthErrors, OfNoPointsAreZero) {
  const DepthErrors errors = depthErrors({}, 100.0);
  EXPECT_EQ(errors.points, 0U);
  EXPECT_EQ(errors.mean_abs_m, 0);
  EXPECT_EQ(errors.median_abs_m, 0);
  EXPECT_EQ(errors.bad_pix_3px.value(), 0);
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
}

}  // namespace
}  // namespace efm
