// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/robust_maximum.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <vector>

namespace efm {
namespace {

TEST(RobustMaximum, IsNothingBeforeTheFirstValue) { EXPECT_FALSE(RobustMaximum().value()); }

TEST(RobustMaximum, IsThePlainMaximumOfFewerThanTwentyValues) {
  RobustMaximum maximum;
  for (int i = 1; i <= 19; ++i) {
    maximum.take(i % 2 == 0 ? i : -i);
    EXPECT_EQ(*maximum.value(), i == 1 ? -1 : i / 2 * 2);
  }
}

TEST(RobustMaximum, OneOutlierInTwentyDoesNotMoveIt) {
  RobustMaximum maximum;
  maximum.take(1e9);
  for (int i = 1; i <= 19; ++i) maximum.take(i);
  EXPECT_EQ(*maximum.value(), 19);
}

TEST(RobustMaximum, IsTheSmallestValueThatNinetyFivePercentDoNotExceed) {
  std::mt19937 random(1);
  RobustMaximum maximum;
  std::vector<double> values;
  for (int n = 1; n <= 300; ++n) {
    const double value = static_cast<double>(random() % 100);  // many of them equal
    maximum.take(value);
    values.push_back(value);
    std::vector<double> sorted = values;
    std::sort(sorted.begin(), sorted.end());
    const auto enough = std::find_if(sorted.begin(), sorted.end(), [&](double candidate) {
      const auto not_above = std::count_if(values.begin(), values.end(),
                                           [&](double other) { return other <= candidate; });
      return 100 * not_above >= 95 * n;
    });
    ASSERT_EQ(*maximum.value(), *enough) << n;
  }
}

}  // namespace
}  // namespace efm
