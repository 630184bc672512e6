// SPDX-License-Identifier: BSD-3-Clause
#include "tracking_stub/sensor/simulated_rig.h"

#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <stdexcept>

namespace efm {
namespace {

constexpr std::int64_t kSecondNs = 1'000'000'000;

std::vector<Event> fireAll(EventNoise& noise, int height, std::int64_t until_ns) {
  std::vector<Event> events;
  for (int y = 0; y < height; ++y) noise.fireRow(y, until_ns, events);
  return events;
}

TEST(EventNoise, EveryPixelFiresAtTheBackgroundRateWithHalfOfEachPolarity) {
  EventNoiseOptions options;
  options.background_hz = 5;
  EventNoise noise(40, 30, options, {1, kSecondNs});
  const auto events = fireAll(noise, 30, 3 * kSecondNs);
  // 12000 expected. The stddev of a Poisson number is its root, 110.
  EXPECT_NEAR(static_cast<double>(events.size()), 12'000, 450);
  int on = 0;
  std::map<std::pair<int, int>, int> per_pixel;
  for (const Event& event : events) {
    on += event.polarity ? 1 : 0;
    ++per_pixel[{event.x, event.y}];
    EXPECT_GE(event.t_ns, kSecondNs);
    EXPECT_LE(event.t_ns, 3 * kSecondNs);
    EXPECT_EQ(event.t_ns % 1000, 0);
  }
  EXPECT_NEAR(on, 6'000, 250);
  // The variance of a Poisson number is its mean: 10.
  double squares = 0;
  for (const auto& [pixel, count] : per_pixel) squares += (count - 10.0) * (count - 10.0);
  EXPECT_NEAR(squares / 1200, 10, 1.7);
}

TEST(EventNoise, AFixedFractionOfThePixelsIsHot) {
  EventNoiseOptions options;
  options.hot_fraction = 0.05;
  options.hot_hz = 200;
  EventNoise noise(100, 80, options, {1, 0});
  std::map<std::pair<int, int>, int> per_pixel;
  for (const Event& event : fireAll(noise, 80, kSecondNs)) ++per_pixel[{event.x, event.y}];
  EXPECT_NEAR(static_cast<double>(per_pixel.size()), 400, 80);
  for (const auto& [pixel, count] : per_pixel) EXPECT_NEAR(count, 200, 75);
}

TEST(EventNoise, DoesNotDependOnTheTimesOfTheCalls) {
  EventNoiseOptions options;
  options.background_hz = 300;
  EventNoise at_once(1, 1, options, {7, 0});
  EventNoise in_steps(1, 1, options, {7, 0});
  EventNoise other_seed(1, 1, options, {8, 0});
  const auto whole = fireAll(at_once, 1, kSecondNs);
  std::vector<Event> parts;
  for (std::int64_t t_ns = 1'234'567; t_ns < kSecondNs; t_ns += 1'234'567) {
    const std::size_t before = parts.size();
    in_steps.fireRow(0, t_ns, parts);
    for (std::size_t i = before; i < parts.size(); ++i) EXPECT_LE(parts[i].t_ns, t_ns);
  }
  in_steps.fireRow(0, kSecondNs, parts);
  ASSERT_GT(whole.size(), 200U);
  EXPECT_EQ(parts, whole);
  EXPECT_NE(fireAll(other_seed, 1, kSecondNs), whole);
}

}  // namespace
}  // namespace efm
