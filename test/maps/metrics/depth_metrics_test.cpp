// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cmath>

#include "maps/metrics/depth_metrics.h"

namespace efm {
namespace {

TEST(PairDepths, PixelsWithoutAnEstimateOrATruthAreLeftOut) {
  const float nan = std::nanf("");
  const cv::Mat1f estimate = (cv::Mat1f(1, 5) << 1, 0, 2, nan, 3);
  const cv::Mat1f truth = (cv::Mat1f(1, 5) << 1, 1, 0, 1, INFINITY);

  const std::vector<DepthPair> pairs = pairDepths({estimate, truth});

  ASSERT_EQ(pairs.size(), 1U);
  EXPECT_EQ(pairs[0].estimate_m, 1);
  EXPECT_EQ(pairs[0].truth_m, 1);
}

TEST(PairDepths, TruthFartherThanTheLimitCountsAsNone) {
  const cv::Mat1f estimate = (cv::Mat1f(1, 3) << 2, 2, 2);
  const cv::Mat1f truth = (cv::Mat1f(1, 3) << 5, 6, 4);

  EXPECT_EQ(pairDepths({estimate, truth}, {0, 5.0}).size(), 2U);
  for (const DepthPairingOptions& wrong : {DepthPairingOptions{-1, 5}, {101, 5}, {0, 0}}) {
    EXPECT_THROW(pairDepths({estimate, truth}, wrong), std::invalid_argument);
  }
  EXPECT_NO_THROW(pairDepths({estimate, truth}, {100, 1e-9}));
}

TEST(PairDepths, ToleranceTakesTheTruthNearestInInverseDepth) {
  // The neighbours of the pixel (2 m) are 1 m and 4 m. 4 m is closer in inverse depth: |1/2 - 1/1|
  // = 0.5, |1/2 - 1/4| = 0.25. 3 m is at the end of the previous row.
  const cv::Mat1f estimate = (cv::Mat1f(2, 3) << 0, 0, 0, 2, 0, 0);
  const cv::Mat1f truth = (cv::Mat1f(2, 3) << 1, 0, 3, 9, 4, 0);

  EXPECT_EQ(pairDepths({estimate, truth}, {0})[0].truth_m, 9);
  EXPECT_EQ(pairDepths({estimate, truth}, {1})[0].truth_m, 4);
}

TEST(PairDepths, MapsOfDifferentSizeAreRejected) {
  EXPECT_THROW(pairDepths({cv::Mat1f::ones(2, 3), cv::Mat1f::ones(3, 2)}), std::invalid_argument);
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

/// Returns all errors.
std::vector<double> valuesOf(const DepthErrors& e) {
  return {e.mean_abs_m,     e.median_abs_m,
          e.median_inverse, e.bad_pix_5px.value_or(-1),
          e.silog,          e.bad_pix_3px.value_or(-1),
          e.aerrr,          e.aerrr_by_estimate,
          e.log_rmse,       e.delta[0],
          e.delta[1],       e.delta[2],
          e.beyond_tenth};
}

void expectMeasures(const std::vector<double>& values, const std::vector<double>& expected) {
  ASSERT_EQ(values.size(), expected.size());
  for (std::size_t i = 0; i < values.size(); ++i) EXPECT_NEAR(values[i], expected[i], 1e-12) << i;
}

TEST(DepthErrors, AreWorkedOutByHand) {
  // |Z - Z_true| = 1, 0, 1, 3; |1/Z - 1/Z_true| = 1/2, 0, 1/2, 3/10; d = ln 2, 0, -ln 2, ln 5/2.
  const DepthErrors errors = depthErrors({{2, 1}, {3, 3}, {1, 2}, {5, 2}});
  EXPECT_EQ(errors.points, 4U);
  const double ln2 = std::log(2.0);
  const double other = std::log(2.5);
  const double squares = (2 * ln2 * ln2 + other * other) / 4;
  expectMeasures(valuesOf(errors), {5.0 / 4, 1, 0.4, -1, 100 * (squares - other * other / 16), -1,
                                    (1 + 0.5 + 1.5) / 4, (0.5 + 1 + 0.6) / 4,
                                    100 * std::sqrt(squares), 0.25, 0.25, 0.25, 0.75});
  expectMeasures(valuesOf(depthErrors({}, 100.0)), std::vector<double>(13, 0.0));
  // An error of exactly a tenth is not beyond a tenth.
  EXPECT_EQ(depthErrors({{2.25, 2.5}, {2.75, 2.5}, {8, 10}}).beyond_tenth, 1.0 / 3);
}

TEST(DepthErrors, MeanOverMapsCountsEachMapTheSameAndEmptyOnesNot) {
  const DepthErrors a = depthErrors({{2, 1}, {1, 1}}, 10.0);
  const DepthErrors b = depthErrors({{4, 1}, {3, 2}, {1, 1}, {1.1, 1}}, 10.0);
  const DepthErrors mean = meanOfErrors({a, depthErrors({}, 10.0), b});
  EXPECT_EQ(mean.points, 6U);
  std::vector<double> expected = valuesOf(a);
  for (std::size_t i = 0; i < 13; ++i) expected[i] = (expected[i] + valuesOf(b)[i]) / 2;
  expectMeasures(valuesOf(mean), expected);
  EXPECT_FALSE(meanOfErrors({a, depthErrors({{1, 1}})}).bad_pix_3px.has_value());
  EXPECT_EQ(meanOfErrors({}).points, 0U);
  expectMeasures(valuesOf(meanOfErrors({})), valuesOf(depthErrors({})));
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
  // A pixel at a limit is good: 69 px for 64 px, and 168 px for 160 px (5 % more).
  EXPECT_EQ(depthErrors({{64, 69}}, 64.0 * 69).bad_pix_5px.value(), 0);
  EXPECT_EQ(depthErrors({{160, 168}}, 160.0 * 168).bad_pix_5px.value(), 0);
  EXPECT_THROW(depthErrors({{1, 1}}, 0.0), std::invalid_argument);
  EXPECT_THROW(depthErrors({{1, 1}}, std::nan("")), std::invalid_argument);
}

TEST(DepthErrors, DeltaCountsRatiosUnderPowersOfFiveFourths) {
  // Ratios of the larger to the smaller depth: 1.2, 1.25 (not under 1.25), 1.5, 1.9, 2.
  const DepthErrors errors = depthErrors({{1.2, 1}, {1, 1.25}, {1.5, 1}, {1, 1.9}, {2, 1}});
  EXPECT_DOUBLE_EQ(errors.delta[0], 1.0 / 5);
  EXPECT_DOUBLE_EQ(errors.delta[1], 3.0 / 5);
  EXPECT_DOUBLE_EQ(errors.delta[2], 4.0 / 5);
}

TEST(PrecisionRecall, AreWorkedOutByHand) {
  ComparedDepths depths;
  // Errors: 0.5, 0.25, none (no estimate), none (no truth), 2.
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
  // The tolerance is the same up and down, and ends at the edges of the image.
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

TEST(PrecisionRecall, RejectsInvalidThresholdsAndSizes) {
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
