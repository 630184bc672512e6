// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/events/background_activity_filter.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <cstdlib>
#include <vector>

#include "test/mapping/keyframes/random_scene.h"

namespace efm::background_activity_filter_test {
namespace {

constexpr std::int64_t kMs = 1'000'000;

Event eventAt(std::int64_t t_ns, int x, int y) {
  return {t_ns, static_cast<std::uint16_t>(x), static_cast<std::uint16_t>(y), false};
}

TEST(BackgroundActivityFilter, EachOfTheEightNeighboursSupportsAnEventAndNoOtherPixel) {
  for (int dy = -2; dy <= 2; ++dy) {
    for (int dx = -2; dx <= 2; ++dx) {
      BackgroundActivityFilter filter(9, 9, 5 * kMs);
      EXPECT_TRUE(filter.isIsolated(eventAt(100 * kMs, 4 + dx, 4 + dy))) << "the first of all";
      const bool neighbor = std::abs(dx) <= 1 && std::abs(dy) <= 1 && (dx != 0 || dy != 0);
      EXPECT_EQ(filter.isIsolated(eventAt(101 * kMs, 4, 4)), !neighbor) << dx << ", " << dy;
    }
  }
}

TEST(BackgroundActivityFilter, SupportLastsForTheGivenTime) {
  BackgroundActivityFilter filter(9, 9, 5 * kMs);
  filter.isIsolated(eventAt(100 * kMs, 4, 4));
  EXPECT_FALSE(filter.isIsolated(eventAt(105 * kMs, 5, 4)));
  EXPECT_TRUE(filter.isIsolated(eventAt(110 * kMs + 1, 4, 4)));
}

TEST(BackgroundActivityFilter, EqualsTheDefinitionOverTheWholePast) {
  int isolated = 0;
  int supported = 0;
  for (std::uint32_t seed = 1; seed <= 10; ++seed) {
    test::RandomScene random(seed);
    const std::vector<Event> events =
        random.events(test::smallCamera(), 2000, -50 * kMs, 200 * kMs);
    BackgroundActivityFilter filter(48, 36, 7 * kMs);
    for (std::size_t i = 0; i < events.size(); ++i) {
      bool expected = true;
      for (std::size_t j = 0; j < i; ++j) {
        const int dx = std::abs(events[i].x - events[j].x);
        const int dy = std::abs(events[i].y - events[j].y);
        if (dx <= 1 && dy <= 1 && dx + dy > 0 && events[i].t_ns - events[j].t_ns <= 7 * kMs) {
          expected = false;
        }
      }
      ASSERT_EQ(filter.isIsolated(events[i]), expected) << "seed " << seed << ", event " << i;
      ++(expected ? isolated : supported);
    }
  }
  EXPECT_GT(isolated, 1000);
  EXPECT_GT(supported, 1000);
}

}  // namespace
}  // namespace efm::background_activity_filter_test
