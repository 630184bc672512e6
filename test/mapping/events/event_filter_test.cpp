// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/events/event_filter.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

#include "test/mapping/base/refused_option.h"
#include "test/mapping/depth/same_image.h"
#include "test/mapping/keyframes/played_recording.h"

namespace efm::event_filter_test {
namespace {

using test::LongRecording;
using test::Played;

constexpr std::int64_t kMs = 1'000'000;

/// Both filters, so strict that a few thousand events have some of everything.
EventFilterOptions strictFilter() {
  EventFilterOptions options;
  options.hot_pixels = true;
  options.hot_pixel.ratio = 3;
  options.hot_pixel.period_s = 0.1;
  options.hot_pixel.min_events = 8;
  options.background_activity_s = 0.02;
  return options;
}

FusionMapperOptions filteredOptions() {
  FusionMapperOptions options = test::playedOptions();
  options.policy.window_s = 0.11;
  options.policy.stride_s = 0.07;
  options.filter = strictFilter();
  return options;
}

/// A recording in which a tenth of the events is of three hot pixels.
LongRecording recordingWithHotPixels(std::uint32_t seed) {
  LongRecording recording(seed, 1.0);
  test::RandomScene random(seed);
  for (std::vector<Event>& events : recording.events) {
    for (Event& event : events) {
      const double kind = random.uniform(0, 1);
      if (kind < 0.1) {
        event.x = static_cast<std::uint16_t>(kind < 0.06 ? 10 : kind < 0.08 ? 30 : 31);
        event.y = 20;
      }
    }
  }
  return recording;
}

TEST(EventFilter, AnEventOfAHotPixelSupportsNoOther) {
  EventFilter filter(20, 20, strictFilter());
  for (int i = 0; i < 8; ++i) filter.keeps({1000 * kMs + i * kMs, 7, 7, true});
  EXPECT_FALSE(filter.keeps({1040 * kMs, 7, 7, true}));
  EXPECT_FALSE(filter.keeps({1041 * kMs, 8, 7, true})) << "(7, 7) is hot since 1007 ms";
  EXPECT_TRUE(filter.keeps({1042 * kMs, 9, 7, true}));
}

TEST(EventFilter, OptionsHaveTheirLimits) {
  using O = EventFilterOptions;
  const std::vector<double> wrong_s = {-1, 0.9e-9, 10.5, NAN};
  test::expectLimits<O>(
      {{"background_activity_s", &O::background_activity_s, {0, 1e-9, 10}, wrong_s}});
}

TEST(FilteredMapping, RemovedEventsAreCountedAndTheOthersAreMapped) {
  for (std::uint32_t seed = 1; seed <= 3; ++seed) {
    const LongRecording recording = recordingWithHotPixels(seed);
    const Played filtered = test::play(recording, filteredOptions(), 0);
    // The same as a recording without those events.
    LongRecording kept = recording;
    for (std::size_t c = 0; c < 2; ++c) {
      EventFilter filter(48, 36, strictFilter());
      std::vector<Event>& events = kept.events[c];
      std::stable_sort(events.begin(), events.end(),
                       [](const Event& a, const Event& b) { return a.t_ns < b.t_ns; });
      const auto end = std::remove_if(events.begin(), events.end(), [&](Event event) {
        event.t_ns = recording.timeOf(c, event);
        return !filter.keeps(event);
      });
      EXPECT_EQ(filtered.counts.cameras[c].filtered,
                static_cast<std::uint64_t>(events.end() - end));
      EXPECT_GT(filtered.counts.cameras[c].filtered, 200U);
      events.erase(end, events.end());
    }
    EXPECT_EQ(filtered.counts.cameras[2].filtered, 0U) << "not selected: dropped";
    FusionMapperOptions unfiltered = filteredOptions();
    unfiltered.filter = {false, {}, 0};
    const Played expected = test::play(kept, unfiltered, 0);
    ASSERT_EQ(filtered.keyframes.size(), expected.keyframes.size());
    EXPECT_GE(expected.keyframes.size(), 3U);
    for (std::size_t k = 0; k < expected.keyframes.size(); ++k) {
      EXPECT_EQ(filtered.keyframes[k].events, expected.keyframes[k].events);
      EXPECT_TRUE(test::same(filtered.keyframes[k].map, expected.keyframes[k].map));
    }
    EXPECT_EQ(filtered.counts.total().used, expected.counts.total().used);
    EXPECT_EQ(filtered.counts.total().without_pose, expected.counts.total().without_pose);
  }
}

TEST(FilteredMapping, EventsUpToTenMillisecondsLateAreSortedFilteredOrNot) {
  LongRecording ordered = recordingWithHotPixels(4);
  for (std::vector<Event>& events : ordered.events) {
    // Each at a time of its own, so that there is one right order.
    for (std::size_t i = 0; i < events.size(); ++i) {
      events[i].t_ns += static_cast<std::int64_t>(i);
    }
  }
  LongRecording reversed = ordered;
  for (std::vector<Event>& events : reversed.events) {
    // Blocks of some 5 ms in reverse.
    for (auto block = events.begin(); events.end() - block >= 20; block += 20) {
      std::reverse(block, block + 20);
    }
  }
  for (const bool filters : {false, true}) {
    FusionMapperOptions options = filteredOptions();
    if (!filters) options.filter = {false, {}, 0};
    const Played in_order = test::play(ordered, options, 0);
    const Played sorted = test::play(reversed, options, 7);
    EXPECT_EQ(in_order.counts.sorted_events, 0U);
    EXPECT_EQ(sorted.counts.sorted_events, 2U * 3000 * 19 / 20);
    EXPECT_EQ(sorted.counts.total().filtered, in_order.counts.total().filtered);
    EXPECT_EQ(sorted.counts.total().filtered > 0, filters);
    ASSERT_EQ(sorted.keyframes.size(), in_order.keyframes.size());
    for (std::size_t k = 0; k < in_order.keyframes.size(); ++k) {
      EXPECT_TRUE(test::same(sorted.keyframes[k].map, in_order.keyframes[k].map));
    }
  }
}

}  // namespace
}  // namespace efm::event_filter_test
