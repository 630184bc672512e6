// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cmath>
#include <opencv2/core.hpp>

#include "mapping/depth/paper_extraction.h"
#include "mapping/depth/peak_fit.h"

namespace efm {
namespace {

/// The share of the squared width that is the variance of the peak's errors.
constexpr double kErrorOfWidth = 0.17;

TEST(PeakVariance, IsTheOneOfTheParabolaWithTheSameCurvature) {
  // 8 (1 - z^2 / (2 * 4)): a variance of 4 planes^2.
  EXPECT_NEAR(peakVariance(7, 8, 7), kErrorOfWidth * 4, 1e-12);
  // 8 - 7 * z^2, a variance of 8 / 14.
  EXPECT_NEAR(peakVariance(1, 8, 1), kErrorOfWidth * 8 / 14, 1e-12);
}

TEST(PeakVariance, OfAWideGaussianIsItsOwn) {
  const auto gaussian = [](double z) {
    return static_cast<float>(30 * std::exp(-z * z / (2 * 4.0 * 4.0)));
  };
  // Three samples of a Gaussian of 4 planes: 1 / (2 - 2 exp(-1 / 32)) = 16.25 instead of 16.
  EXPECT_NEAR(peakVariance(gaussian(-1), gaussian(0), gaussian(1)), kErrorOfWidth * 16.25, 0.01);
}

TEST(PeakVariance, DoesNotDependOnTheUnitOfVotes) {
  EXPECT_NEAR(peakVariance(700, 800, 750), peakVariance(7, 8, 7.5F), 1e-9);
}

TEST(PeakVariance, IsInfiniteWhereThereIsNoCurvature) {
  EXPECT_TRUE(std::isinf(peakVariance(5, 5, 5)));
  EXPECT_TRUE(std::isinf(peakVariance(0, 0, 0)));
  EXPECT_TRUE(std::isinf(peakVariance(-1, 5, 3))) << "the first plane";
  EXPECT_TRUE(std::isinf(peakVariance(3, 5, -1))) << "the last plane";
  EXPECT_TRUE(std::isinf(peakVariance(-1, 5, -1))) << "the only plane";
}

/// One bright pixel in the middle of 9x9.
DsiPeaks onePeak(int plane, float before, float peak, float after) {
  DsiPeaks peaks{cv::Mat1f::zeros(9, 9), cv::Mat1i::zeros(9, 9), cv::Mat1f(9, 9, -1.0F),
                 cv::Mat1f(9, 9, -1.0F)};
  peaks.plane(4, 4) = plane;
  peaks.before(4, 4) = before;
  peaks.confidence(4, 4) = peak;
  peaks.after(4, 4) = after;
  return peaks;
}

TEST(DepthVariance, IsThatOfInverseDepth) {
  // Planes 1/m apart by 0.1: from 1 m to 1 / 0.5 m.
  const DepthPlanes planes({1.0, 2.0, 6, PlaneSpacing::kInverse});
  const DepthMap map = extractAsPaper(onePeak(3, 7, 8, 7), planes, {});
  EXPECT_NEAR(map.variance(4, 4), 0.1 * 0.1 * kErrorOfWidth * 4, 1e-8);
  EXPECT_EQ(cv::countNonZero(map.variance), 1) << "0 where there is no depth";
}

TEST(DepthVariance, WithLinearSpacingGoesByTheStepsAroundThePeak) {
  // 1, 1.5, 2, 2.5, 3 m. Around 2 m: from 1.75 to 2.25 m.
  const DepthPlanes planes({1.0, 3.0, 5, PlaneSpacing::kLinear});
  const double step = 1 / 1.75 - 1 / 2.25;
  EXPECT_NEAR(planes.inverseDepthStepAt(2), step, 1e-12);
  const DepthMap map = extractAsPaper(onePeak(2, 7, 8, 7), planes, {});
  EXPECT_NEAR(map.variance(4, 4), step * step * kErrorOfWidth * 4, 1e-7);
}

TEST(DepthVariance, StepsAreTheSameEverywhereWithInverseSpacing) {
  const DepthPlanes planes({0.5, 5.0, 100, PlaneSpacing::kInverse});
  for (const double position : {0.0, 0.2, 0.5, 41.7, 98.9, 99.0}) {
    EXPECT_NEAR(planes.inverseDepthStepAt(position), planes.inverseDepthStep(), 1e-12) << position;
  }
}

TEST(DepthVariance, AtTheLimitsIsInfiniteWhateverTheSpacing) {
  for (const PlaneSpacing spacing : {PlaneSpacing::kInverse, PlaneSpacing::kLinear}) {
    const DepthPlanes planes({1.0, 3.0, 5, spacing});
    for (const auto& peaks : {onePeak(0, -1, 8, 7), onePeak(4, 7, 8, -1), onePeak(2, 8, 8, 8)}) {
      EXPECT_TRUE(std::isinf(extractAsPaper(peaks, planes, {}).variance(4, 4)));
    }
  }
}

TEST(DepthVariance, OfASinglePlaneIsInfinite) {
  const DepthPlanes planes({1.0, 3.0, 1, PlaneSpacing::kInverse});
  const DepthMap map = extractAsPaper(onePeak(0, -1, 8, -1), planes, {});
  EXPECT_EQ(map.depth(4, 4), 1.0F);
  EXPECT_TRUE(std::isinf(map.variance(4, 4))) << map.variance(4, 4);
}

}  // namespace
}  // namespace efm
