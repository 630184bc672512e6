// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/events/event_filter.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <vector>

#include "test/mapping/depth/same_image.h"
#include "test/mapping/keyframes/played_recording.h"
#include "test/mapping/options/refused_option.h"

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

void expectToAddUp(const MapperCounts& counts) {
  for (const EventCounts& c : counts.cameras) {
    EXPECT_EQ(c.read, c.used + c.without_pose + c.outside_window + c.dropped + c.filtered +
                          c.outside_lens + c.over_budget);
  }
}

TEST(EventFilter, AnEventOfAHotPixelSupportsNoOther) {
  EventFilter filter(20, 20, strictFilter());
  for (int i = 0; i < 8; ++i) filter.keeps({1000 * kMs + i * kMs, 7, 7, true});
  EXPECT_FALSE(filter.keeps({1040 * kMs, 7, 7, true}));
  EXPECT_FALSE(filter.keeps({1041 * kMs, 8, 7, true})) << "(7, 7) is hot since 1007 ms";
  EXPECT_TRUE(filter.keeps({1042 * kMs, 9, 7, true}));
}

TEST(EventFilter, KeepsEverythingWhenSwitchedOff) {
  EventFilterOptions off;
  off.hot_pixels = false;
  EXPECT_FALSE(off.any());
  EventFilter filter(20, 20, off);
  for (int i = 0; i < 1000; ++i) EXPECT_TRUE(filter.keeps({i * kMs, 7, 7, true}));
}

TEST(EventFilter, InvalidTimesAreNamed) {
  test::expectRefused<EventFilterOptions>("background_activity_s = -1",
                                          [](auto& o) { o.background_activity_s = -1; });
  test::expectRefused<EventFilterOptions>("background_activity_s = ",
                                          [](auto& o) { o.background_activity_s = 1e-12; });
  test::expectRefused<EventFilterOptions>("background_activity_s = 10.5",
                                          [](auto& o) { o.background_activity_s = 10.5; });
}

TEST(FilteredMapping, RemovedEventsAreCountedAndTheOthersAreMapped) {
  for (std::uint32_t seed = 1; seed <= 3; ++seed) {
    const LongRecording recording = recordingWithHotPixels(seed);
    const Played filtered = test::play(recording, filteredOptions(), 0);
    expectToAddUp(filtered.counts);

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
    unfiltered.filter.hot_pixels = false;
    unfiltered.filter.background_activity_s = 0;
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

TEST(FilteredMapping, LateEventsAreFilteredInTimeOrder) {
  LongRecording recording = recordingWithHotPixels(4);
  for (std::vector<Event>& events : recording.events) {
    // Each at a time of its own, so that there is one right order.
    for (std::size_t i = 0; i < events.size(); ++i) {
      events[i].t_ns += static_cast<std::int64_t>(i);
    }
  }
  const Played in_order = test::play(recording, filteredOptions(), 0);
  for (std::vector<Event>& events : recording.events) {
    // Blocks of some 5 ms in reverse.
    for (std::size_t i = 0; i + 20 <= events.size(); i += 20) {
      const auto first = events.begin() + static_cast<std::ptrdiff_t>(i);
      std::reverse(first, first + 20);
    }
  }
  const Played shuffled = test::play(recording, filteredOptions(), 7);
  EXPECT_GT(shuffled.counts.sorted_events, 1000U);
  EXPECT_EQ(shuffled.counts.total().filtered, in_order.counts.total().filtered);
  ASSERT_EQ(shuffled.keyframes.size(), in_order.keyframes.size());
  for (std::size_t k = 0; k < in_order.keyframes.size(); ++k) {
    EXPECT_TRUE(test::same(shuffled.keyframes[k].map, in_order.keyframes[k].map));
  }
}

TEST(FilteredMapping, ARecordingOfNoiseAloneHasNoKeyframeAndAllItsEventsAreFiltered) {
  LongRecording recording(1, 1.0);
  for (std::vector<Event>& events : recording.events) {
    for (Event& event : events) event.x = event.y = 5;  // alone in the image
  }
  const Played played = test::play(recording, filteredOptions(), 3);
  EXPECT_EQ(played.keyframes.size(), 0U);
  for (std::size_t c = 0; c < 2; ++c) {
    EXPECT_EQ(played.counts.cameras[c].filtered, recording.events[c].size());
  }
  expectToAddUp(played.counts);
}

TEST(FilteredMapping, CamerasOfOnePixelAndCamerasWithoutEventsAreNoErrors) {
  FusionMapperOptions options = filteredOptions();
  options.cameras = {};
  FusionMapper mapper(options);
  RigCamera one_pixel;
  one_pixel.model = {1, 1, 1.0, 1.0, 0.0, 0.0, DistortionModel::kNone, {}};
  mapper.addCamera(one_pixel);
  mapper.addCamera(one_pixel);
  for (int i = 0; i <= 50; ++i) mapper.addPose({i * 10 * kMs, {}});
  for (int i = 0; i < 400; ++i) mapper.addEvents(0, {{i * kMs, 0, 0, true}});
  mapper.finish();
  while (mapper.next()) {
  }
  EXPECT_EQ(mapper.counts().cameras[0].filtered, 400U) << "no neighbour supports them";
  EXPECT_EQ(mapper.counts().cameras[1].read, 0U);
  expectToAddUp(mapper.counts());
}

}  // namespace
}  // namespace efm::event_filter_test
