// SPDX-License-Identifier: BSD-3-Clause
#include "maps/metrics/depth_metrics.h"

#include <gtest/gtest.h>

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
  const cv::Mat1f estimate = (cv::Mat1f(1, 3) << 2, 2, 2);
  const cv::Mat1f truth = (cv::Mat1f(1, 3) << 5, 6, 4);

  EXPECT_EQ(pairDepths(estimate, truth, {0, 5.0}).size(), 2U);
  for (const DepthPairingOptions& wrong : {DepthPairingOptions{-1, 5}, {101, 5}, {0, 0}}) {
    EXPECT_THROW(pairDepths(estimate, truth, wrong), std::invalid_argument);
  }
  EXPECT_NO_THROW(pairDepths(estimate, truth, {100, 1e-9}));
}

TEST(PairDepths, ToleranceTakesTheTruthNearestInInverseDepth) {
  // Around the pixel: 1 m and 4 m. |1/2 - 1/1| = 0.5, |1/2 - 1/4| = 0.25, although 1 m is the
  // nearer one in depth. 3 m is at the end of the row before.
  const cv::Mat1f estimate = (cv::Mat1f(2, 3) << 0, 0, 0, 2, 0, 0);
  const cv::Mat1f truth = (cv::Mat1f(2, 3) << 1, 0, 3, 9, 4, 0);

  EXPECT_EQ(pairDepths(estimate, truth, {0})[0].truth_m, 9);
  EXPECT_EQ(pairDepths(estimate, truth, {1})[0].truth_m, 4);
}

TEST(PairDepths, MapsOfDifferentSizeAreRefused) {
  EXPECT_THROW(pairDepths(cv::Mat1f::ones(2, 3), cv::Mat1f::ones(3, 2)), std::invalid_argument);
}

TEST(PairDepths, AMaskLeavesOutEstimatesAndTruths) {
  ComparedDepths depths;
  depths.estimate = (cv::Mat1f(1, 3) << 2, 2, 0);
  depths.truth = (cv::Mat1f(1, 3) << 1, 3, 2);
  depths.mask = (cv::Mat1b(1, 3) << 0, 255, 0);
  EXPECT_EQ(pairDepths(depths).size(), 1U);
  // The neighbours are nearer to the estimate, but the mask leaves them out.
  EXPECT_EQ(pairDepths(depths, {1}).at(0).truth_m, 3);

  depths.mask = cv::Mat1b(2, 3, uchar{1});
  EXPECT_THROW(pairDepths(depths), std::invalid_argument);
}

}  // namespace
}  // namespace efm
