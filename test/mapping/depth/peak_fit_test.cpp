// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/depth/peak_fit.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>

namespace efm::peak_fit_test {
namespace {

/// Variance of the peak's errors, as a fraction of the squared width.
constexpr double kErrorOfWidth = 0.17;

TEST(PeakPosition, IsTheVertexOfTheParabola) {
  // 10 - 2 (z - 7.2)^2 at z = 6, 7, 8.
  const auto value = [](double z) { return static_cast<float>(10 - 2 * (z - 7.2) * (z - 7.2)); };
  EXPECT_NEAR(peakPosition(7, value(6), value(7), value(8)), 7.2, 1e-6);
}

TEST(PeakPosition, StaysAtThePeakWhereThereIsNoVertex) {
  EXPECT_EQ(peakPosition(0, -1, 5, 3), 0);
  EXPECT_EQ(peakPosition(99, 3, 5, -1), 99);
  EXPECT_EQ(peakPosition(7, 5, 5, 5), 7);
}

TEST(PeakPosition, IsAtMostHalfAPlaneAway) { EXPECT_EQ(peakPosition(7, 0, 5, 5), 7.5); }

TEST(PeakWidth, IsThePeakOverTheCurvature) {
  EXPECT_FLOAT_EQ(peakWidthSquared(1, 8, 1), 8.0F / 14);
  for (const auto& [before, peak, after] :
       {std::array{5.0F, 5.0F, 5.0F}, {-1.0F, 5.0F, 3.0F}, {3.0F, 5.0F, -1.0F}}) {
    EXPECT_TRUE(std::isinf(peakWidthSquared(before, peak, after)));
  }
}

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

}  // namespace
}  // namespace efm::peak_fit_test
