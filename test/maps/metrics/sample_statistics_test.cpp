// SPDX-License-Identifier: BSD-3-Clause
#include "maps/metrics/sample_statistics.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numeric>

namespace efm {
namespace {

TEST(SampleStatistics, AreWorkedOutByHand) {
  // Sum 10, squares 1 + 1 + 4 + 36 = 42; differences from 2.5: 1.5^2 * 2 + 0.5^2 + 3.5^2 = 17.
  const SampleStatistics statistics = statisticsOf({1, 6, 2, 1});
  EXPECT_EQ(statistics.count, 4U);
  EXPECT_DOUBLE_EQ(statistics.mean, 2.5);
  EXPECT_DOUBLE_EQ(statistics.median, 1.5);
  EXPECT_DOUBLE_EQ(statistics.rms, std::sqrt(10.5));
  EXPECT_DOUBLE_EQ(statistics.stddev, std::sqrt(17.0 / 4));
  EXPECT_EQ(statistics.min, 1);
  EXPECT_EQ(statistics.max, 6);
}

TEST(SampleStatistics, WithoutValuesAreZero) {
  EXPECT_EQ(statisticsOf({}).count, 0U);
  EXPECT_EQ(statisticsOf({}).rms, 0);
  EXPECT_EQ(quantileOf({}, 0.5), 0);
}

TEST(SampleStatistics, AQuantileIsTheSmallestValueAboveItsFraction) {
  std::vector<double> values(10);
  std::iota(values.rbegin(), values.rend(), 1.0);  // 10 … 1
  EXPECT_EQ(quantileOf(values, 0.9), 9);
  EXPECT_EQ(quantileOf(values, 0.91), 10);
  EXPECT_EQ(quantileOf(values, 1), 10);
  EXPECT_EQ(quantileOf(values, 1e-9), 1);
  EXPECT_THROW(quantileOf(values, 0), std::invalid_argument);
  EXPECT_THROW(quantileOf(values, 1.001), std::invalid_argument);
  EXPECT_EQ(medianOf({5, 1, 3}), 3);
}

}  // namespace
}  // namespace efm
