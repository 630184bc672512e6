// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/live/input_queue.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>

namespace efm {
namespace {

constexpr std::int64_t kIntervalNs = 10'000'000;

/// Events of camera 0, at these times; x tells them apart.
std::vector<Event> eventsAt(const std::vector<std::int64_t>& times_ns) {
  std::vector<Event> events;
  for (const std::int64_t t_ns : times_ns) {
    events.push_back({t_ns, static_cast<std::uint16_t>(events.size()), 0, true});
  }
  return events;
}

/// Passes events in packets that end at these indices, each covered until its last event.
std::vector<Event> passed(EventBudget& budget, const std::vector<Event>& events,
                          std::vector<std::size_t> ends, bool covered) {
  std::vector<Event> result;
  std::sort(ends.begin(), ends.end());
  ends.push_back(events.size());
  std::size_t begin = 0;
  for (const std::size_t end : ends) {
    std::optional<std::int64_t> until_ns;
    if (covered && end > begin) until_ns = events[end - 1].t_ns;
    std::vector<Event> packet(events.begin() + static_cast<std::ptrdiff_t>(begin),
                              events.begin() + static_cast<std::ptrdiff_t>(end));
    for (const Event& event : budget.pass(std::move(packet), until_ns)) result.push_back(event);
    begin = end;
  }
  for (const Event& event : budget.finish()) result.push_back(event);
  return result;
}

RC_GTEST_PROP(EventBudget, KeepsAtMostTheBudgetOfEach10MsWhateverThePackets, ()) {
  auto times_ns = *rc::gen::container<std::vector<std::int64_t>>(
      rc::gen::inRange<std::int64_t>(-5 * kIntervalNs, 5 * kIntervalNs));
  std::sort(times_ns.begin(), times_ns.end());
  const std::vector<Event> events = eventsAt(times_ns);
  const auto ends = *rc::gen::container<std::vector<std::size_t>>(
      rc::gen::inRange<std::size_t>(0, events.size() + 1));
  const std::size_t max = *rc::gen::inRange<std::size_t>(1, 8);
  const double rate = 100.0 * static_cast<double>(max);

  EventBudget whole(rate);
  const std::vector<Event> expected = passed(whole, events, {}, false);
  EventBudget budget(rate);
  const std::vector<Event> result = passed(budget, events, ends, *rc::gen::arbitrary<bool>());

  RC_ASSERT(result == expected);
  RC_ASSERT(budget.thinned() + result.size() == events.size());
  const auto in_interval = [](const std::vector<Event>& all, std::int64_t k) {
    return static_cast<std::size_t>(std::count_if(all.begin(), all.end(), [k](const Event& event) {
      return event.t_ns >= k * kIntervalNs && event.t_ns < (k + 1) * kIntervalNs;
    }));
  };
  for (std::int64_t k = -5; k < 5; ++k) {
    RC_ASSERT(in_interval(result, k) == std::min(max, in_interval(events, k)));
  }
}

TEST(EventBudget, AStepOfTheClockBackHoldsNothingForGood) {
  EventBudget budget(100);
  std::optional<std::int64_t> none;
  budget.pass(eventsAt({100 * kIntervalNs}), none);
  const auto after = budget.pass(eventsAt({0, 1 * kIntervalNs, 2 * kIntervalNs}), none);
  EXPECT_EQ(after.size(), 3U) << "the one before the step, and two after it";
  EXPECT_EQ(budget.held(), 1U);
}

TEST(EventBudget, LateEventsCountForTheCurrent10Ms) {
  std::vector<std::int64_t> times_ns;
  for (std::int64_t i = 0; i < 60; ++i) {  // twenty of each 10 ms, and as many from 20 ms before
    times_ns.push_back((100 + i / 20) * kIntervalNs + i % 20);
    times_ns.push_back(times_ns.back() - 2 * kIntervalNs);
  }
  EventBudget budget(500);
  EXPECT_EQ(passed(budget, eventsAt(times_ns), {}, false).size(), 15U);
  EXPECT_EQ(budget.thinned(), 105U);
}

TEST(EventBudget, CoverEndsBeforeTheEventsThatAreHeld) {
  EventBudget budget(100);
  std::optional<std::int64_t> covered_ns = kIntervalNs + 5;
  EXPECT_EQ(budget.pass(eventsAt({3, 4, kIntervalNs + 1}), covered_ns).size(), 1U);
  EXPECT_EQ(*covered_ns, kIntervalNs);
}

CameraPacket packet(int camera, std::int64_t t_ns, std::size_t events) {
  RigCamera calibration;
  calibration.model = {120, 90, 100.0, 100.0, 59.5, 44.5, DistortionModel::kNone, {}};
  return {camera, calibration, std::vector<Event>(events, Event{t_ns, 0, 0, true}), std::nullopt};
}

TEST(InputQueue, DropsTheOldestPacketsAndNoPoseWhereItIsFull) {
  LiveOptions options;
  options.max_event_rate = 0;
  options.max_queue_events = 1000;
  InputQueue queue(options);
  queue.add(QueuedPose{{1, {}}, {}, {}});
  queue.add(packet(0, 10, 600));
  queue.add(packet(1, 20, 300));
  queue.add(packet(0, 30, 400));   // the first one has to go
  queue.add(packet(1, 40, 2000));  // and then all: it is too large by itself

  const auto counts = queue.counts();
  EXPECT_EQ(counts.at(0).dropped, 1000U);
  EXPECT_EQ(counts.at(1).dropped, 2300U);
  queue.add(packet(1, 50, 7));
  const InputQueue::Batch batch = queue.take();
  EXPECT_EQ(batch.poses.size(), 1U);
  ASSERT_EQ(batch.packets.size(), 1U);
  EXPECT_EQ(batch.packets[0].events.size(), 7U);
  EXPECT_EQ(batch.missing.at(0).until_ns, 31);
  EXPECT_EQ(batch.missing.at(1).until_ns, 41);
  EXPECT_TRUE(queue.take().missing.empty());
  EXPECT_EQ(queue.counts().at(1).taken, 7U);
}

TEST(InputQueue, CountsItsMemoryToo) {
  LiveOptions options;
  options.max_queue_mb = 1;
  InputQueue queue(options);
  for (int i = 0; i < 100'000; ++i) queue.add(packet(0, i, 0));
  EXPECT_LT(queue.take().packets.size(), 1'000'000 / sizeof(CameraPacket) + 1);
}

TEST(InputQueue, EndPassesTheHeldEvents) {
  LiveOptions options;
  options.max_event_rate = 1000;
  InputQueue queue(options);
  queue.add(packet(0, 5, 30));
  EXPECT_EQ(queue.counts().at(0).held, 30U);
  queue.end();
  queue.add(packet(0, 6, 30));  // too late
  const InputQueue::Batch batch = queue.wait();
  EXPECT_TRUE(batch.ended);
  ASSERT_EQ(batch.packets.size(), 2U);
  EXPECT_EQ(batch.packets[1].events.size(), 10U);
  EXPECT_EQ(queue.counts().at(0).thinned, 20U);
  EXPECT_EQ(queue.counts().at(0).received, 60U);
  EXPECT_EQ(queue.counts().at(0).after_end, 30U);
  EXPECT_EQ(queue.counts().at(0).queued, 0U);
  queue.skip(packet(0, 7, 5));
  EXPECT_EQ(queue.counts().at(0).paused, 5U);
  queue.add(QueuedPose{{1, {}}, {}, {}});
  EXPECT_EQ(queue.posesAfterEnd(), 1U);
  EXPECT_TRUE(queue.take().poses.empty());
}

}  // namespace
}  // namespace efm
