// SPDX-License-Identifier: BSD-3-Clause
#include "test/bench/growth_fit.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <cmath>
#include <stdexcept>

namespace efm::bench {
namespace {

TEST(GrowthFit, TimeThatDoublesWithTheSizeHasExponentOne) {
  EXPECT_NEAR(fittedExponent({1, 2, 4, 8}, {3, 6, 12, 24}), 1, 1e-12);
}

TEST(GrowthFit, TimeThatDoesNotChangeHasExponentZero) {
  EXPECT_NEAR(fittedExponent({10, 100, 1000}, {5, 5, 5}), 0, 1e-12);
}

/// Logarithms of the sizes 0, 1, 2 and of the times 0, 1, 1 (base e): slope 1/2.
TEST(GrowthFit, TheExponentIsTheSlopeOfTheLeastSquaresLine) {
  const double e = std::exp(1.0);
  EXPECT_NEAR(fittedExponent({1, e, e * e}, {1, e, e}), 0.5, 1e-12);
}

RC_GTEST_PROP(GrowthFit, DoesNotDependOnTheUnits, ()) {
  const double exponent = 0.01 * *rc::gen::inRange(-300, 300);
  const double factor = std::exp(0.1 * *rc::gen::inRange(-100, 100));
  const double unit = std::exp(0.1 * *rc::gen::inRange(-100, 100));
  std::vector<double> sizes;
  std::vector<double> times;
  for (const double size : {1.0, 1.5, 4.0, 9.0, 30.0}) {
    sizes.push_back(unit * size);
    times.push_back(factor * std::pow(size, exponent));
  }
  RC_ASSERT(std::abs(fittedExponent(sizes, times) - exponent) < 1e-9);
}

TEST(GrowthFit, RefusesSamplesWithoutAnExponent) {
  EXPECT_THROW(fittedExponent({}, {}), std::invalid_argument);
  EXPECT_THROW(fittedExponent({2, 2}, {1, 3}), std::invalid_argument);
  EXPECT_THROW(fittedExponent({1, 2}, {1}), std::invalid_argument);
  EXPECT_THROW(fittedExponent({1, 2}, {1, 0}), std::invalid_argument);
  EXPECT_THROW(fittedExponent({-1, 2}, {1, 1}), std::invalid_argument);
}

}  // namespace
}  // namespace efm::bench
