// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/events/event_filter.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <cstdlib>
#include <vector>

#include "test/mapping/keyframes/random_scene.h"

namespace efm::background_activity_filter_test {
namespace {

constexpr std::int64_t kMs = 1'000'000;

TEST(BackgroundActivityFilter, EqualsTheDefinitionOverTheWholePast) {
  int isolated = 0;
  int supported = 0;
  for (std::uint32_t seed = 1; seed <= 10; ++seed) {
    test::RandomScene random(seed);
    std::vector<Event> events = random.events(test::smallCamera(), 2000, -50 * kMs, 200 * kMs);
    for (Event& event : events) event.t_ns -= event.t_ns % kMs;  // also exactly the time apart
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
