// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/session/recording_statistics.h"

#include <gtest/gtest.h>

#include <numeric>

#include "mapping/geometry/timestamp.h"

namespace efm {
namespace {

TEST(EventRate, KeepsTheRateOverAnyLengthOfTime) {
  for (const std::int64_t step_ns : {1'000LL, 10'000'000LL, 3'600'000'000'000LL}) {
    const std::int64_t start_ns = 1'700'000'000'000'000'000;
    EventRate rate;
    // 10,000 steps: one event each, none, and two each.
    for (std::int64_t i = 0; i < 10'000; ++i) {
      const std::int64_t t_ns = start_ns + i * step_ns;
      if (i < 2500 || i >= 5000) rate.add(t_ns);
      if (i >= 5000) rate.add(t_ns);
    }
    const double step_s = 1e-9 * static_cast<double>(step_ns);
    const std::vector<double> rates = rate.over(start_ns, start_ns + 10'000 * step_ns, 40);
    for (const auto& [interval, expected] :
         std::vector<std::pair<std::size_t, double>>{{0, 1}, {8, 1}, {15, 0}, {22, 2}, {38, 2}}) {
      EXPECT_NEAR(rates[interval] * step_s, expected, 0.05) << interval << " of " << step_ns;
    }
    const double total = std::accumulate(rates.begin(), rates.end(), 0.0) * 250 * step_s;
    EXPECT_NEAR(total, 12'500, 1e-3);
  }
}

TEST(EventRate, AnEventBeforeTheFirstCountsAtTheStart) {
  EventRate rate;
  for (const std::int64_t t_ns : {5'000'000LL, 1'000'000LL, 9'000'000LL}) rate.add(t_ns);
  const std::vector<double> rates = rate.over(1'000'000, 9'000'001, 2);
  EXPECT_NEAR((rates[0] + rates[1]) * 0.004, 3, 1e-3);
  EXPECT_EQ(EventRate().over(0, 1'000, 3), std::vector<double>(3, 0.0));
}

TEST(EventRate, CountsOfABinAreInProportionToItsOverlap) {
  EventRate rate;
  EXPECT_EQ(rate.countIn(0, 5000), 0);
  for (const std::int64_t t_ns : {0, 1, 2, 3, 1024, 1025}) rate.add(10'000 + t_ns);  // two bins
  EXPECT_EQ(rate.countIn(10'000, 10'512), 2);
  EXPECT_EQ(rate.countIn(9'488, 10'512), 2);
  EXPECT_EQ(rate.countIn(10'512, 11'536), 2 + 1);
  EXPECT_EQ(rate.countIn(10'256, 20'000), 3 + 2);
  EXPECT_EQ(rate.countIn(9'000, 10'000), 0);
  EXPECT_EQ(rate.countIn(12'048, 20'000), 0);
}

TEST(Sparkline, HasAHeightPerValue) {
  EXPECT_EQ(sparkline({0.5, 1, 2, 3, 4, 5, 6, 7, 8}), "▁▂▃▄▅▆▇██");
  EXPECT_EQ(sparkline({0, 1, 4, 8}), " ▂▅█");
  EXPECT_EQ(sparkline({0, 0}), "  ");
}

}  // namespace
}  // namespace efm
