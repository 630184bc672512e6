// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <new>
#include <set>
#include <vector>

#include "mapping/events/event.h"
#include "mapping/events/event_filter.h"
#include "mapping/events/window.h"
#include "test/mapping/depth/same_image.h"
#include "test/mapping/keyframes/played_recording.h"
#include "test/mapping/keyframes/random_scene.h"
#include "test/memory/failing_allocation.h"

namespace efm::event_filter_test {
namespace {

constexpr std::int64_t kMs = 1'000'000;

TEST(BackgroundActivityFilter, EqualsTheDefinitionOverTheWholePast) {
  int isolated = 0;
  int supported = 0;
  for (std::uint32_t seed = 1; seed <= 10; ++seed) {
    test::RandomScene random(seed);
    std::vector<Event> events = random.events(test::smallCamera(), 2000, -50 * kMs, 200 * kMs);
    for (Event& event : events) event.t_ns -= event.t_ns % kMs;  // some are exactly 7 ms apart
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

/// Applies the definition to the whole past: events of the current and the previous period.
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
    // Times are also before 0. There are few pixels, so that busy pixels are adjacent.
    std::vector<Event> events = random.events(small, 900, -300 * kMs, 900 * kMs);
    for (Event& event : events) {
      event.t_ns -= event.t_ns % (10 * kMs);  // some at the ends of periods
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

using test::LongRecording;
using test::Played;

/// Returns options with both filters, so strict that a few thousand events have every fate.
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

/// Returns a recording with a tenth of the events from three hot pixels.
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

TEST(FilteredMapping, RemovedEventsAreCountedAndTheOthersAreMapped) {
  for (std::uint32_t seed = 1; seed <= 3; ++seed) {
    const LongRecording recording = recordingWithHotPixels(seed);
    const Played filtered = test::play(recording, filteredOptions(), 0);
    // The result equals that of a recording without the filtered events.
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
      EXPECT_EQ(filtered.counts.cameras[c][EventFate::kFiltered],
                static_cast<std::uint64_t>(events.end() - end));
      EXPECT_GT(filtered.counts.cameras[c][EventFate::kFiltered], 200U);
      events.erase(end, events.end());
    }
    EXPECT_EQ(filtered.counts.cameras[2][EventFate::kFiltered], 0U) << "not selected: dropped";
    FusionMapperOptions unfiltered = filteredOptions();
    unfiltered.filter = {false, {}, 0};
    const Played expected = test::play(kept, unfiltered, 0);
    ASSERT_EQ(filtered.keyframes.size(), expected.keyframes.size());
    EXPECT_GE(expected.keyframes.size(), 3U);
    for (std::size_t k = 0; k < expected.keyframes.size(); ++k) {
      EXPECT_EQ(filtered.keyframes[k].events, expected.keyframes[k].events);
      EXPECT_TRUE(test::same(filtered.keyframes[k].map, expected.keyframes[k].map));
    }
    EXPECT_EQ(filtered.counts.total()[EventFate::kUsed], expected.counts.total()[EventFate::kUsed]);
    EXPECT_EQ(filtered.counts.total()[EventFate::kWithoutPose],
              expected.counts.total()[EventFate::kWithoutPose]);
  }
}

TEST(FilteredMapping, EventsUpToTenMillisecondsLateAreSortedFilteredOrNot) {
  LongRecording ordered = recordingWithHotPixels(4);
  for (std::vector<Event>& events : ordered.events) {
    // Every event has a different time, so that only one order is right.
    for (std::size_t i = 0; i < events.size(); ++i) {
      events[i].t_ns += static_cast<std::int64_t>(i);
    }
  }
  LongRecording reversed = ordered;
  for (std::vector<Event>& events : reversed.events) {
    // Blocks of about 5 ms are reversed.
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
    EXPECT_EQ(sorted.counts.total()[EventFate::kFiltered],
              in_order.counts.total()[EventFate::kFiltered]);
    EXPECT_EQ(sorted.counts.total()[EventFate::kFiltered] > 0, filters);
    ASSERT_EQ(sorted.keyframes.size(), in_order.keyframes.size());
    for (std::size_t k = 0; k < in_order.keyframes.size(); ++k) {
      EXPECT_TRUE(test::same(sorted.keyframes[k].map, in_order.keyframes[k].map));
    }
  }
}

TEST(Event, IsTheSameUnlessOneOfItsFieldsDiffers) {
  const Event event{1, 2, 3, true};
  EXPECT_TRUE(event == (Event{1, 2, 3, true}));
  for (const Event& other : {Event{9, 2, 3, true}, {1, 9, 3, true}, {1, 2, 9, true}, {1, 2, 3}}) {
    EXPECT_FALSE(event == other);
  }
}

TEST(EventBuffer, SortsLateEventsWithTheirMarksAndFreesReleasedOnes) {
  EventBuffer buffer;
  EXPECT_EQ(buffer.insert(std::vector<Event>{{10, 0, 0}, {20, 1, 0}, {30, 2, 0}, {40, 3, 0}}), 0U);
  buffer.used[2] = true;
  EXPECT_EQ(buffer.insert(std::vector<Event>{{20, 4, 0}, {15, 5, 0}, {40, 6, 0}, {50, 7, 0}}), 2U);
  std::vector<int> order;  // of equal times, later inserted events follow
  for (const Event& event : buffer.events) order.push_back(event.x);
  EXPECT_EQ(order, (std::vector<int>{0, 5, 1, 4, 2, 3, 6, 7}));
  EXPECT_EQ(buffer.used,
            (std::vector<bool>{false, false, false, false, true, false, false, false}));
  EXPECT_EQ(buffer.between(20, 40).size(), 3U);
  buffer.begin = 3;
  EXPECT_EQ(buffer.indexOf(0), 3U);
  buffer.begin = 4;  // half of the events
  buffer.compact();
  EXPECT_EQ(buffer.begin, 0U);
  EXPECT_EQ(buffer.events.size(), 4U);
  EXPECT_EQ(buffer.used, (std::vector<bool>{true, false, false, false}));
}

TEST(EventBuffer, WithoutMemoryItStaysAsItWas) {
  EventBuffer buffer;
  buffer.insert(std::vector<Event>{{10, 0, 0}, {20, 1, 0}, {30, 2, 0}});
  buffer.used[1] = true;
  const EventBuffer earlier = buffer;
  const std::vector<Event> late(100, {15, 3, 0});
  std::size_t failures = 0;
  for (bool failed = true; failed; failures += failed ? 1 : 0) {
    failAllocation(Allocating::kThisThread, failures);
    failed = false;
    try {
      buffer.insert(late);
    } catch (const std::bad_alloc&) {
      failed = true;
    }
    stopFailing();
    if (!failed) continue;
    ASSERT_EQ(buffer.events, earlier.events) << failures;
    ASSERT_EQ(buffer.used, earlier.used) << failures;
  }
  EXPECT_GE(failures, 3U) << "events, marks and the sorting need memory";
  EXPECT_EQ(buffer.events.size(), 103U);
}

TEST(TimeLimits, AreInOrderWhereBothAreGiven) {
  using Limits = TimeLimits;
  for (const Limits& limits : {Limits{}, {5, {}}, {{}, -5}, {-5, {}}, {{}, 5}, {-6, -5}, {5, 6}}) {
    EXPECT_NO_THROW(limits.validate());
  }
  EXPECT_THROW((Limits{5, 5}.validate()), std::invalid_argument);
  EXPECT_THROW((Limits{6, 5}.validate()), std::invalid_argument);
}

TEST(EvenChoice, TakesOneEventOfEachIntervalOfEqualCount) {
  for (const std::size_t events : {1U, 2U, 7U, 100U, 12345U}) {
    for (const std::size_t limit : {1U, 2U, 3U, 6U, 99U, 5000U, 12344U}) {
      const EvenChoice choice(events, limit);
      ASSERT_EQ(choice.size(), std::min(events, limit));
      EXPECT_EQ(choice.all(), limit >= events);
      const double interval = static_cast<double>(events) / static_cast<double>(choice.size());
      for (std::size_t k = 0; k < choice.size(); ++k) {
        const auto index = static_cast<double>(choice[k]);
        ASSERT_GT(index + 1, interval * static_cast<double>(k)) << events << ", " << limit;
        ASSERT_LT(index, interval * static_cast<double>(k + 1)) << events << ", " << limit;
        ASSERT_TRUE(k == 0 || choice[k] > choice[k - 1]);
      }
    }
  }
}

TEST(EvenChoice, HasNoRegularStep) {
  const EvenChoice choice(8000, 1000);
  std::set<std::size_t> offsets;
  std::size_t odd = 0;
  for (std::size_t k = 0; k < choice.size(); ++k) {
    offsets.insert(choice[k] % 8);
    odd += choice[k] % 2;
  }
  EXPECT_EQ(offsets.size(), 8U) << "every position in an interval occurs";
  EXPECT_NEAR(static_cast<double>(odd), 500, 80) << "of alternating polarities both are chosen";
}

TEST(EvenChoice, WithoutALimitTheEventsAreNotCopied) {
  std::vector<Event> events(50);
  for (std::size_t i = 0; i < events.size(); ++i) events[i].x = static_cast<std::uint16_t>(i);
  std::vector<Event> buffer(3);
  for (const std::size_t limit : {0U, 50U, 51U}) {
    EXPECT_EQ(chooseEvenly(events, limit, buffer).begin(), events.data());
    EXPECT_EQ(chosenEvenly(events, limit), events);
  }
  const std::vector<Event> chosen = chosenEvenly(events, 9);
  const EvenChoice choice(50, 9);
  ASSERT_EQ(chosen.size(), 9U);
  for (std::size_t k = 0; k < 9; ++k) EXPECT_EQ(chosen[k].x, choice[k]);
  EXPECT_EQ(chooseEvenly(events, 9, buffer).size(), 9U);
  EXPECT_TRUE(chooseEvenly({}, 1, buffer).empty());
}

}  // namespace

}  // namespace efm::event_filter_test
