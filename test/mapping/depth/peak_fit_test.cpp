// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/depth/peak_fit.h"

#include <gtest/gtest.h>

#include <cmath>

namespace efm::peak_fit_test {
namespace {

TEST(PeakFit, IsTheParabolaThroughThreeValues) {
  /// Variance of the peak's errors, as a fraction of the squared width.
  constexpr double kErrorOfWidth = 0.17;
  const struct {
    float before, peak, after;
    double offset;    // of the position from the peak's plane
    double width_sq;  // planes^2
  } cases[] = {
      {7.12F, 9.92F, 8.72F, 0.2, 2.48},  // 10 - 2 (z - 0.2)^2
      {1, 8, 1, 0, 8.0 / 14},
      {7, 8, 7, 0, 4},
      {8, 10, 9, 1.0 / 6, 10.0 / 3},
      {9, 10, 8, -1.0 / 6, 10.0 / 3},
      {900, 1000, 800, -1.0 / 6, 10.0 / 3},  // in any unit
      {0, 5, 5, 0.5, 1},                     // at most half a plane away
      {5, 5, 0, -0.5, 1},
      {5, 5, 5, 0, INFINITY},
      {0, 0, 0, 0, INFINITY},
      {-1, 5, 3, 0, INFINITY},  // the first plane
      {3, 5, -1, 0, INFINITY},  // the last plane
      {-1, 5, -1, 0, INFINITY},
  };
  for (const auto& c : cases) {
    SCOPED_TRACE(testing::Message() << c.before << ", " << c.peak << ", " << c.after);
    EXPECT_NEAR(peakPosition(7, c.before, c.peak, c.after), 7 + c.offset, 1e-6);
    const double variance = peakVariance(c.before, c.peak, c.after);
    const float width_sq = peakWidthSquared(c.before, c.peak, c.after);
    if (std::isinf(c.width_sq)) {
      EXPECT_TRUE(std::isinf(width_sq) && std::isinf(variance));
    } else {
      EXPECT_NEAR(width_sq, c.width_sq, 1e-6);
      EXPECT_NEAR(variance, kErrorOfWidth * c.width_sq, 1e-6);
    }
  }
}

}  // namespace
}  // namespace efm::peak_fit_test
