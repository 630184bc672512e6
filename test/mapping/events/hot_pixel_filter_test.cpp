// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/events/event_filter.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

#include "test/mapping/base/refused_option.h"
#include "test/mapping/keyframes/random_scene.h"

namespace efm::hot_pixel_filter_test {
namespace {

constexpr std::int64_t kMs = 1'000'000;

HotPixelOptions fewEvents() {
  HotPixelOptions options;
  options.ratio = 3;
  options.period_s = 0.1;
  options.min_events = 6;
  return options;
}

Event eventAt(std::int64_t t_ns, int x, int y) {
  return {t_ns, static_cast<std::uint16_t>(x), static_cast<std::uint16_t>(y), true};
}

/// The definition, from the whole past: events of the clock's period and the one before.
std::vector<bool> naivelyHot(const std::vector<Event>& events, int width, int height,
                             const HotPixelOptions& options) {
  const double period_ns = options.period_s * 1e9;
  const auto periodOf = [&](const Event& event) {
    return std::floor(static_cast<double>(event.t_ns) / period_ns);
  };
  std::vector<bool> hot;
  for (std::size_t i = 0; i < events.size(); ++i) {
    const auto count = [&](int x, int y) {
      int n = 0;
      for (std::size_t j = 0; j <= i; ++j) {
        const bool recent = periodOf(events[i]) - periodOf(events[j]) <= 1;
        if (recent && events[j].x == x && events[j].y == y) ++n;
      }
      return n;
    };
    const int own = count(events[i].x, events[i].y);
    std::vector<int> around(2, 0);
    for (int y = events[i].y - 1; y <= events[i].y + 1; ++y) {
      for (int x = events[i].x - 1; x <= events[i].x + 1; ++x) {
        if (x != events[i].x || y != events[i].y) around.push_back(count(x, y));
      }
    }
    std::sort(around.begin(), around.end());
    const bool on_border = events[i].x == 0 || events[i].y == 0 || events[i].x + 1 == width ||
                           events[i].y + 1 == height;
    hot.push_back(width > 1 && height > 1 && own >= options.min_events &&
                  own > options.ratio * around[around.size() - (on_border ? 1 : 2)]);
  }
  return hot;
}

TEST(HotPixelFilter, ManyMoreEventsThanFitACountAreStillHot) {
  HotPixelOptions options = fewEvents();
  options.period_s = 100;
  HotPixelFilter filter(4, 4, options);
  for (int i = 0; i < 200'000; ++i) {
    ASSERT_EQ(filter.isHot(eventAt(1000 * kMs + i, 1, 1)), i >= 5) << i;
  }
}

TEST(HotPixelFilter, EqualsTheDefinitionOverTheWholePast) {
  int found = 0;
  for (std::uint32_t seed = 1; seed <= 20; ++seed) {
    test::RandomScene random(seed);
    CameraModel small = test::smallCamera();
    small.width = seed == 1 ? 1 : 6;
    small.height = seed == 2 ? 1 : 5;
    // Also before time 0; few pixels, so that busy ones are adjacent.
    std::vector<Event> events = random.events(small, 900, -300 * kMs, 900 * kMs);
    for (Event& event : events) {
      event.t_ns -= event.t_ns % (10 * kMs);  // also at the ends of periods
      const double kind = random.uniform(0, 1);
      if (kind < 0.4) event.x = event.y = 0;
      if (seed <= 2) continue;
      if (kind > 0.4 && kind < 0.6) event.x = 3, event.y = 2;
      if (kind > 0.6 && kind < 0.7) event.x = 4, event.y = 2;
    }
    HotPixelOptions options = fewEvents();
    options.ratio = 2 + seed % 5;
    const std::vector<bool> expected = naivelyHot(events, small.width, small.height, options);
    HotPixelFilter filter(small.width, small.height, options);
    for (std::size_t i = 0; i < events.size(); ++i) {
      ASSERT_EQ(filter.isHot(events[i]), expected[i]) << "seed " << seed << ", event " << i;
      if (expected[i]) ++found;
    }
  }
  EXPECT_GT(found, 1000) << "both answers are there";
}

TEST(HotPixelOptions, HaveTheirLimits) {
  using O = HotPixelOptions;
  test::expectLimits<O>({{"hot_pixel_ratio", &O::ratio, {2, 1000}, {1.9, 1001, NAN}},
                         {"hot_pixel_period_s", &O::period_s, {0.001, 100}, {0, 0.00099, 101, NAN}},
                         {"hot_pixel_min_events", &O::min_events, {2, 30'000}, {1, 30'001}}});
}

}  // namespace
}  // namespace efm::hot_pixel_filter_test
