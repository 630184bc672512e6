// SPDX-License-Identifier: BSD-3-Clause
#include "maps/metrics/precision_recall.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

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

/// A map with holes.
cv::Mat1f drawMap(int rows, int cols) {
  cv::Mat1f map(rows, cols);
  for (float& depth_m : map) depth_m = 0.1F * static_cast<float>(*rc::gen::inRange(0, 20));
  return map;
}

RC_GTEST_PROP(PrecisionRecall, GrowWithTheThresholdAndAddUpOverMaps, ()) {
  const std::vector<double> thresholds = {0.05, 0.25, 0.55, 1.05};
  const int tolerance_px = *rc::gen::inRange(0, 3);
  const ComparedDepths a{drawMap(4, 5), drawMap(4, 5), {}};
  const ComparedDepths b{drawMap(4, 5), drawMap(4, 5), {}};
  const PrecisionRecall of_a = precisionRecall(a, thresholds, {tolerance_px});
  PrecisionRecall sum = of_a;
  const PrecisionRecall of_b = precisionRecall(b, thresholds, {tolerance_px});
  sum.add(of_b);

  RC_ASSERT(sum.estimates == of_a.estimates + of_b.estimates);
  RC_ASSERT(sum.truths == of_a.truths + of_b.truths);
  RC_ASSERT(sum.estimates_without_truth ==
            of_a.estimates_without_truth + of_b.estimates_without_truth);

  RC_ASSERT(of_a.estimates == pairDepths(a, {tolerance_px}).size());
  for (std::size_t k = 1; k < thresholds.size(); ++k) {
    RC_ASSERT(sum.precision(k - 1) <= sum.precision(k));
    RC_ASSERT(sum.recall(k - 1) <= sum.recall(k));
    RC_ASSERT(sum.f1(k) <= std::max(sum.precision(k), sum.recall(k)) + 1e-12);
  }
  if (tolerance_px == 0) {
    // Without tolerance, adjacent maps give the same as two maps.
    ComparedDepths both;
    cv::hconcat(a.estimate, b.estimate, both.estimate);
    cv::hconcat(a.truth, b.truth, both.truth);
    const PrecisionRecall of_both = precisionRecall(both, thresholds);
    for (std::size_t k = 0; k < thresholds.size(); ++k) {
      RC_ASSERT(of_both.f1(k) == sum.f1(k));
      RC_ASSERT(sum.steps[k].correct_estimates == sum.steps[k].found_truths);
    }
  }
}

}  // namespace
}  // namespace efm
