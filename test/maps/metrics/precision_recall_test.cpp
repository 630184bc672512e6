// SPDX-License-Identifier: BSD-3-Clause
#include "maps/metrics/depth_metrics.h"

#include <gtest/gtest.h>

namespace efm {
namespace {

TEST(PrecisionRecall, AreWorkedOutByHand) {
  ComparedDepths depths;
  // Errors 0.5, 0.25, none (no estimate), none (no truth), 2.
  depths.estimate = (cv::Mat1f(1, 6) << 1.5, 2.25, 0, 4, 7, 0);
  depths.truth = (cv::Mat1f(1, 6) << 1, 2, 3, 0, 5, 6);

  const PrecisionRecall counts = precisionRecall(depths, {0.25, 0.5, 10, 0.1});

  EXPECT_EQ(counts.estimates, 3U);
  EXPECT_EQ(counts.truths, 5U);
  EXPECT_EQ(counts.estimates_without_truth, 1U);
  EXPECT_DOUBLE_EQ(counts.precision(0), 1.0 / 3);
  EXPECT_DOUBLE_EQ(counts.recall(0), 1.0 / 5);
  EXPECT_DOUBLE_EQ(counts.f1(0), 2.0 / 8) << "2 of what is right over all that is looked at";
  EXPECT_DOUBLE_EQ(counts.precision(1), 2.0 / 3);
  EXPECT_DOUBLE_EQ(counts.recall(1), 2.0 / 5);
  EXPECT_DOUBLE_EQ(counts.precision(2), 1);
  EXPECT_DOUBLE_EQ(counts.recall(2), 3.0 / 5);
  EXPECT_EQ(counts.f1(3), 0);
  EXPECT_EQ(defaultDepthThresholds(), (std::vector<double>{0.01, 0.02, 0.03, 0.05, 0.07, 0.1, 0.15,
                                                           0.2, 0.3, 0.5, 0.7, 1, 2, 5}));

  PrecisionRecall twice = counts;
  twice.add(counts);
  EXPECT_EQ(twice.estimates, 6U);
  EXPECT_EQ(twice.truths, 10U);
  EXPECT_EQ(twice.estimates_without_truth, 2U);
  for (std::size_t k = 0; k < 4; ++k) {
    EXPECT_EQ(twice.precision(k), counts.precision(k)) << k;
    EXPECT_EQ(twice.recall(k), counts.recall(k)) << k;
  }
}

TEST(PrecisionRecall, ToleranceFindsTruthsAroundAnEstimate) {
  ComparedDepths depths;
  depths.estimate = (cv::Mat1f(1, 4) << 0, 2, 0, 0);
  depths.truth = (cv::Mat1f(1, 4) << 2, 9, 2, 2);
  const PrecisionRecall strict = precisionRecall(depths, {0.5});
  EXPECT_EQ(strict.precision(0), 0);
  EXPECT_EQ(strict.recall(0), 0);
  const PrecisionRecall tolerant = precisionRecall(depths, {0.5}, {1});
  EXPECT_EQ(tolerant.precision(0), 1);
  EXPECT_DOUBLE_EQ(tolerant.recall(0), 2.0 / 4) << "the first and the third of four";
  // As far up and down, and to the edges of the picture.
  depths = {cv::Mat1f::zeros(5, 5), cv::Mat1f(5, 5, 2.0F), {}};
  depths.estimate(2, 2) = depths.estimate(4, 4) = depths.estimate(0, 0) = 2;
  EXPECT_EQ(precisionRecall(depths, {0.5}, {1}).recall(0), 15.0 / 25);
  depths.truth = depths.estimate.clone();
  depths.estimate = 2;
  const PrecisionRecall sparse = precisionRecall(depths, {0.5}, {1});
  EXPECT_EQ(sparse.estimates, 15U);
  EXPECT_EQ(sparse.estimates_without_truth, 10U);
}

TEST(PrecisionRecall, CountsOnlyTruthInsideMaskAndDepth) {
  ComparedDepths depths;
  depths.estimate = (cv::Mat1f(1, 4) << 1, 1, 1, 50);
  depths.truth = (cv::Mat1f(1, 4) << 1, 1, 2, 50);
  depths.mask = (cv::Mat1b(1, 4) << 0, 1, 1, 1);
  const PrecisionRecall counts = precisionRecall(depths, {0.1}, {0, 10.0});
  EXPECT_EQ(counts.truths, 2U);
  EXPECT_EQ(counts.estimates, 2U);
  EXPECT_EQ(counts.estimates_without_truth, 1U) << "beyond the maximum depth";
  EXPECT_EQ(counts.precision(0), 0.5);
}

TEST(PrecisionRecall, WithoutPixelsAreZero) {
  const ComparedDepths depths{cv::Mat1f::zeros(2, 2), cv::Mat1f::zeros(2, 2), {}};
  const PrecisionRecall counts = precisionRecall(depths, {1});
  EXPECT_EQ(counts.precision(0), 0);
  EXPECT_EQ(counts.recall(0), 0);
  EXPECT_EQ(counts.f1(0), 0);
}

TEST(PrecisionRecall, RefusesInvalidThresholdsAndSizes) {
  const ComparedDepths depths{cv::Mat1f::ones(2, 2), cv::Mat1f::ones(2, 2), {}};
  EXPECT_THROW(precisionRecall(depths, {0.1, 0}), std::invalid_argument);
  EXPECT_THROW(precisionRecall({cv::Mat1f::ones(2, 3), cv::Mat1f::ones(2, 2), {}}, {1}),
               std::invalid_argument);
  PrecisionRecall counts = precisionRecall(depths, {0.1});
  EXPECT_THROW(counts.add(precisionRecall(depths, {0.2})), std::invalid_argument);
  EXPECT_THROW(counts.add(precisionRecall(depths, {0.1, 0.2})), std::invalid_argument);
}

}  // namespace
}  // namespace efm
