// SPDX-License-Identifier: BSD-3-Clause
#include "tracking_stub/sensor/simulated_rig.h"

#include <gtest/gtest.h>

#include <cmath>
#include <stdexcept>

namespace efm {
namespace {

class OnePixel : public ::testing::Test {
 protected:
  OnePixel() : pixels(1, 1, EventPixelOptions{0.2, 0.2}) { pixels.start(level(1.0F)); }
  static cv::Mat1f level(float log_intensity) { return cv::Mat1f(1, 1, log_intensity); }
  std::vector<Event> step(const FrameStep& step, float from, float to) {
    std::vector<Event> events;
    pixels.fireRow(0, step, level(from), level(to), events);
    return events;
  }
  EventPixels pixels;
};

TEST_F(OnePixel, FiresAtTheTimeWhenTheThresholdIsCrossed) {
  // From 1.0 to 1.5 in 10 ms: 1.2 is crossed after 4 ms, 1.4 after 8 ms.
  const auto events = step({0, 10'000'000}, 1.0F, 1.5F);
  ASSERT_EQ(events.size(), 2U);
  EXPECT_EQ(events[0], (Event{4'000'000, 0, 0, true}));
  EXPECT_EQ(events[1], (Event{8'000'000, 0, 0, true}));
}

TEST_F(OnePixel, RemembersItsLastEventAcrossSteps) {
  EXPECT_TRUE(step({0, 10'000'000}, 1.0F, 1.15F).empty());
  // The step from 1.15 to 1.35 crosses 1.2 after a quarter of its time.
  const auto brighter = step({10'000'000, 20'000'000}, 1.15F, 1.35F);
  ASSERT_EQ(brighter.size(), 1U);
  EXPECT_EQ(brighter[0].t_ns, 12'500'000);
  // Back to 1.0: one threshold below 1.2, reached at the very end.
  const auto darker = step({20'000'000, 30'000'000}, 1.35F, 0.999F);
  ASSERT_EQ(darker.size(), 1U);
  EXPECT_FALSE(darker[0].polarity);
  EXPECT_NEAR(static_cast<double>(darker[0].t_ns), 30'000'000, 50'000);
}

TEST_F(OnePixel, FiresAtOnceWhenItStartsAThresholdAwayWithoutAChange) {
  EventPixels running(1, 1, EventPixelOptions{0.2, 0.2});
  running.start(level(1.0F));
  std::vector<Event> events;
  running.fireRow(0, {5'000, 10'000}, level(1.5F), level(1.5F), events);
  ASSERT_EQ(events.size(), 2U);
  EXPECT_EQ(events[0].t_ns, 5'000);
  EXPECT_EQ(events[1].t_ns, 5'000);
}

TEST_F(OnePixel, StampsWholeMicrosecondsAlsoOfALargeClock) {
  const std::int64_t t0_ns = 1'700'000'000'123'456'789;
  for (const Event& event : step({t0_ns, t0_ns + 777'777}, 1.0F, 3.0F)) {
    EXPECT_EQ(event.t_ns % 1000, 0);
    EXPECT_GE(event.t_ns, t0_ns - 500);
    EXPECT_LE(event.t_ns, t0_ns + 777'777 + 500);
  }
}

TEST_F(OnePixel, IsSilentWithoutAChange) { EXPECT_TRUE(step({0, 1'000'000}, 1.0F, 1.0F).empty()); }

std::vector<Event> fireAll(EventPixels& pixels, const cv::Mat1f& from, const cv::Mat1f& to) {
  std::vector<Event> events;
  for (int y = 0; y < from.rows; ++y) pixels.fireRow(y, {0, 1'000'000}, from, to, events);
  return events;
}

TEST(EventPixels, StartWithinTheirThresholdsOfTheCurrentIntensity) {
  struct Row {
    EventPixelOptions thresholds;
    float change;
    double fired, tolerance;  // of 3600 pixels
  };
  // A change by half a threshold fires a quarter of the pixels. With thresholds of 0.1 and 0.4,
  // half of the pixels wait for 0 to 0.1: a change by 0.05 fires a quarter, too.
  for (const Row& row : {Row{{0.2, 0.2}, 0.1F, 900, 100}, Row{{0.1, 0.4}, 0.05F, 900, 100}}) {
    const cv::Mat1f seen(60, 60, 3.0F);
    EventPixels pixels(60, 60, row.thresholds);
    pixels.start(seen, 5);
    EXPECT_TRUE(fireAll(pixels, seen, seen).empty());
    const auto fired = fireAll(pixels, seen, cv::Mat1f(60, 60, 3.0F + row.change));
    EXPECT_NEAR(static_cast<double>(fired.size()), row.fired, row.tolerance);
  }
}

TEST(EventPixels, HaveAThresholdEachForBrighterAndDarker) {
  EventPixels pixels(1, 1, EventPixelOptions{0.1, 0.25});
  const cv::Mat1f low(1, 1, 0.0F);
  const cv::Mat1f high(1, 1, 1.01F);
  pixels.start(low);
  std::vector<Event> up;
  std::vector<Event> down;
  pixels.fireRow(0, {0, 1'000'000}, low, high, up);
  pixels.fireRow(0, {1'000'000, 2'000'000}, high, low, down);
  EXPECT_EQ(up.size(), 10U);
  EXPECT_EQ(down.size(), 4U);
}

TEST(EventPixels, MismatchScattersThresholdsFromPixelToPixel) {
  EventPixelOptions options{0.1, 0.1};
  options.mismatch = 0.1;
  const cv::Mat1f low(60, 60, 0.0F);
  const cv::Mat1f high(60, 60, 10.0F);
  const auto counts_of = [&](std::uint64_t seed) {
    EventPixels pixels(60, 60, options, seed);
    pixels.start(low);
    std::vector<double> counts(3600, 0.0);
    for (const Event& event : fireAll(pixels, low, high))
      ++counts[static_cast<std::size_t>(event.y * 60 + event.x)];
    return counts;
  };
  // A pixel fires 10 / threshold times: its threshold is 10 / count, to 1 %.
  double sum = 0;
  double squares = 0;
  for (const double count : counts_of(3)) {
    sum += 10 / count;
    squares += 100 / count / count;
  }
  EXPECT_NEAR(sum / 3600, 0.1, 0.001);
  EXPECT_NEAR(std::sqrt(squares / 3600 - sum * sum / 3600 / 3600), 0.01, 0.0005);
  EXPECT_EQ(counts_of(3), counts_of(3));
  EXPECT_NE(counts_of(3), counts_of(4));
}

TEST(EventPixels, AreBlindForTheRefractoryPeriodAndThenRememberTheCurrentIntensity) {
  EventPixelOptions options{0.2, 0.2};
  options.refractory_ns = 3'000'000;
  EventPixels pixels(1, 1, options);
  // The change is 0.1 per millisecond. 0.2 is crossed at 2 ms, and the pixel is blind until 5 ms.
  // From 0.5 it crosses 0.7 at 7 ms and is blind until 10 ms. From 1.0 it crosses 1.2 at 12 ms.
  const auto at = [](float value) { return cv::Mat1f(1, 1, value); };
  pixels.start(at(0));
  std::vector<Event> events;
  pixels.fireRow(0, {0, 4'000'000}, at(0), at(0.4F), events);
  pixels.fireRow(0, {4'000'000, 10'000'000}, at(0.4F), at(1), events);
  pixels.fireRow(0, {10'000'000, 14'000'000}, at(1), at(1.4F), events);
  ASSERT_EQ(events.size(), 3U);
  EXPECT_NEAR(static_cast<double>(events[0].t_ns), 2'000'000, 1'000);
  EXPECT_NEAR(static_cast<double>(events[1].t_ns), 7'000'000, 1'000);
  EXPECT_NEAR(static_cast<double>(events[2].t_ns), 12'000'000, 2'000);
}

}  // namespace
}  // namespace efm
