// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/events/event.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <new>
#include <vector>

#include "mapping/events/window.h"
#include "test/memory/failing_allocation.h"

namespace efm::event_buffer_test {
namespace {

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
  std::vector<int> order;  // each after others of the same time
  for (const Event& event : buffer.events) order.push_back(event.x);
  EXPECT_EQ(order, (std::vector<int>{0, 5, 1, 4, 2, 3, 6, 7}));
  EXPECT_EQ(buffer.used,
            (std::vector<bool>{false, false, false, false, true, false, false, false}));
  EXPECT_EQ(buffer.between(20, 40).size(), 3U);
  buffer.begin = 3;
  EXPECT_EQ(buffer.indexOf(0), 3U);
  buffer.begin = 4;  // a half
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

}  // namespace
}  // namespace efm::event_buffer_test
