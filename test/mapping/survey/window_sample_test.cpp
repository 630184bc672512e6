// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/survey/scene_depths.h"

#include <gmock/gmock.h>

namespace efm {
namespace {

TEST(SpreadSamples, KeepsAtMostEightEvenlySpreadOfAnyNumber) {
  for (const std::size_t count : {0, 1, 7, 8, 9, 16, 17, 1000}) {
    SpreadSamples spread;
    const Trajectory trajectory;
    for (std::size_t i = 0; i < count; ++i) {
      const auto t0_ns = static_cast<std::int64_t>(i) * 100;
      spread.add({{t0_ns, t0_ns + 100, t0_ns + 50}, {}, &trajectory});
    }
    const std::vector<WindowSample>& samples = spread.samples();
    EXPECT_LE(samples.size(), SpreadSamples::kMaxSamples) << count;
    EXPECT_GE(samples.size(), std::min(count, SpreadSamples::kMaxSamples / 2)) << count;
    for (std::size_t i = 0; i < samples.size(); ++i) {
      const std::int64_t step_ns = samples.size() > 1 ? samples[1].window.t0_ns : 0;
      EXPECT_EQ(samples[i].window.t0_ns, static_cast<std::int64_t>(i) * step_ns) << count;
    }
    if (samples.size() < 2) continue;
    // The rest after the last sample is not longer than two steps.
    EXPECT_GT(samples.back().window.t0_ns + 2 * samples[1].window.t0_ns,
              static_cast<std::int64_t>(count - 1) * 100)
        << count;
  }
}

TEST(WindowSample, HasItsEventsWithinAWindowAndAroundItsMiddle) {
  WindowSample sample;
  sample.window = {0, 1000, 500};
  sample.events.emplace_back();
  for (std::int64_t t_ns = 0; t_ns < 1000; t_ns += 100)
    sample.events[0].push_back({t_ns, 0, 0, true});
  EXPECT_EQ(eventsWithin(sample, {200, 400, 300})[0].size(), 2U);  // 400 is outside
  const WindowData middle = middleOf(sample, 400e-9);
  EXPECT_EQ(middle.window.t0_ns, 300);
  EXPECT_EQ(middle.window.t1_ns, 700);
  EXPECT_EQ(middle.events[0].size(), 4U);
  EXPECT_EQ(middle.window.t_ref_ns, 500);
  EXPECT_EQ(middleOf(sample, 1).events[0].size(), 10U);
}

}  // namespace
}  // namespace efm
