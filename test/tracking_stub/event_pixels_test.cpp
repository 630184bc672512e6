// SPDX-License-Identifier: BSD-3-Clause
#include "tracking_stub/event_pixels.h"

#include <gtest/gtest.h>

#include <cmath>
#include <stdexcept>

namespace efm {
namespace {

class OnePixel : public ::testing::Test {
 protected:
  OnePixel() : pixels(1, 1, 0.2) { pixels.start(level(1.0F)); }
  static cv::Mat1f level(float log_intensity) { return cv::Mat1f(1, 1, log_intensity); }
  std::vector<Event> step(const FrameStep& step, float from, float to) {
    std::vector<Event> events;
    pixels.fireRow(0, step, level(from), level(to), events);
    return events;
  }
  EventPixels pixels;
};

TEST_F(OnePixel, FiresWheneverTheThresholdIsCrossedAtTheTimeOfCrossing) {
  // From 1.0 to 1.5 in 10 ms: 1.2 is crossed after 4 ms, 1.4 after 8 ms.
  const auto events = step({0, 10'000'000}, 1.0F, 1.5F);
  ASSERT_EQ(events.size(), 2U);
  EXPECT_EQ(events[0], (Event{4'000'000, 0, 0, true}));
  EXPECT_EQ(events[1], (Event{8'000'000, 0, 0, true}));
}

TEST_F(OnePixel, RemembersItsLastEventAcrossSteps) {
  EXPECT_TRUE(step({0, 10'000'000}, 1.0F, 1.15F).empty());
  // 1.2 is crossed a quarter of the way from 1.15 to 1.35.
  const auto brighter = step({10'000'000, 20'000'000}, 1.15F, 1.35F);
  ASSERT_EQ(brighter.size(), 1U);
  EXPECT_EQ(brighter[0].t_ns, 12'500'000);
  // Back to 1.0: one threshold below 1.2, reached at the very end.
  const auto darker = step({20'000'000, 30'000'000}, 1.35F, 0.999F);
  ASSERT_EQ(darker.size(), 1U);
  EXPECT_FALSE(darker[0].polarity);
  EXPECT_NEAR(static_cast<double>(darker[0].t_ns), 30'000'000, 50'000);
}

TEST_F(OnePixel, FiresContrastOverThresholdEvents) {
  EXPECT_EQ(step({0, 1'000'000}, 1.0F, 2.01F).size(), 5U);
}

TEST_F(OnePixel, FiresAtOnceWhereItStartsAThresholdAwayAndNothingChanges) {
  EventPixels running(1, 1, 0.2);
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

TEST_F(OnePixel, IsSilentWhileNothingChanges) {
  EXPECT_TRUE(step({0, 1'000'000}, 1.0F, 1.0F).empty());
}

TEST(EventPixels, StartWithinTheThresholdOfWhatTheySee) {
  const cv::Mat1f seen(40, 40, 3.0F);
  EventPixels pixels(40, 40, 0.2);
  pixels.start(seen, 5);
  std::vector<Event> still;
  std::vector<Event> brighter;
  for (int y = 0; y < 40; ++y) pixels.fireRow(y, {0, 1'000'000}, seen, seen, still);
  EXPECT_TRUE(still.empty());
  // A change by half a threshold reaches the quarter of the pixels that were nearest to it.
  const cv::Mat1f later(40, 40, 3.1F);
  for (int y = 0; y < 40; ++y) pixels.fireRow(y, {0, 1'000'000}, seen, later, brighter);
  EXPECT_NEAR(static_cast<double>(brighter.size()), 400, 60);
}

TEST(EventPixels, RefuseAThresholdThatIsNotPositive) {
  EXPECT_THROW(EventPixels(4, 4, 0), std::invalid_argument);
  EXPECT_THROW(EventPixels(4, 4, std::nan("")), std::invalid_argument);
}

}  // namespace
}  // namespace efm
