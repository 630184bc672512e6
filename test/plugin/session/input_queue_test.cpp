// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/session/input_queue.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <numeric>
#include <tuple>
#include <utility>

namespace efm {
namespace {

constexpr std::int64_t kIntervalNs = 10'000'000;

/// Returns events of camera 0 at the given times. Each has another x.
std::vector<Event> eventsAt(const std::vector<std::int64_t>& times_ns) {
  std::vector<Event> events;
  for (const std::int64_t t_ns : times_ns) {
    events.push_back({t_ns, static_cast<std::uint16_t>(events.size()), 0, true});
  }
  return events;
}

/// Passes packets that end before the indices `ends`, complete until their last event if `covered`.
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
  RC_ASSERT(budget.subsampled() + result.size() == events.size());
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
  for (std::int64_t i = 0; i < 60; ++i) {  // 20 events per 10 ms, and 20 that are 20 ms late
    times_ns.push_back((100 + i / 20) * kIntervalNs + i % 20);
    times_ns.push_back(times_ns.back() - 2 * kIntervalNs);
  }
  EventBudget budget(500);
  EXPECT_EQ(passed(budget, eventsAt(times_ns), {}, false).size(), 15U);
  EXPECT_EQ(budget.subsampled(), 105U);
}

TEST(EventBudget, CoverEndsBeforeTheEventsThatAreHeld) {
  EventBudget budget(100);
  std::optional<std::int64_t> covered_ns = kIntervalNs + 5;
  EXPECT_EQ(budget.pass(eventsAt({3, 4, kIntervalNs + 1}), covered_ns).size(), 1U);
  EXPECT_EQ(*covered_ns, kIntervalNs);
}

/// @param t_ns time of the last event; the first event is earlier.
std::vector<Event> eventsUntil(std::int64_t t_ns, std::size_t count) {
  std::vector<Event> events(count, Event{t_ns, 0, 0, true});
  if (count > 1) events.front().t_ns -= 3;
  return events;
}

EventPacket packet(int camera, std::int64_t t_ns, std::size_t count) {
  return {camera, CheckedEvents(eventsUntil(t_ns, count))};
}

RC_GTEST_PROP(InputQueue, KeepsTheNewestPacketsThatFitIntoEventsAndMemoryAndAllPoses, ()) {
  LiveOptions options;
  options.max_event_rate = 0;
  options.max_queue_events = *rc::gen::inRange(1, 200);
  const std::size_t fit = *rc::gen::inRange<std::size_t>(1, 10);
  const std::size_t events_that_fit = *rc::gen::inRange<std::size_t>(0, 100);
  options.max_queue_mb =
      1e-6 * static_cast<double>(fit * sizeof(QueuedPacket) + events_that_fit * sizeof(Event));
  InputQueue queue(options);
  struct Waiting {
    int camera;
    std::size_t events;
    std::int64_t t_ns;
    bool skipped = false;
  };
  std::deque<Waiting> waiting;
  std::map<int, std::int64_t> missing_ns;
  std::map<int, QueueCounts> expected;
  std::size_t poses = 0;
  const auto sum = [&](auto of) {
    return std::accumulate(
        waiting.begin(), waiting.end(), std::uint64_t{0},
        [&](std::uint64_t total, const Waiting& one) { return total + of(one); });
  };
  const auto events_of = [](const Waiting& one) { return one.events; };
  const auto bytes_of = [](const Waiting& one) {
    return sizeof(QueuedPacket) + one.events * sizeof(Event);
  };
  const auto miss = [&](const Waiting& one) {
    if (one.events == 0 && !one.skipped) return;
    missing_ns[one.camera] = std::max(missing_ns[one.camera], one.t_ns + 1);
  };
  enum { kTake = 8, kPause };
  const auto steps = *rc::gen::container<std::vector<std::tuple<int, int, int>>>(rc::gen::tuple(
      rc::gen::inRange(0, kPause + 1), rc::gen::inRange(0, 3), rc::gen::inRange(0, 90)));
  std::int64_t t_ns = 2'000'000'000;
  for (; poses < 3; ++poses) {  // a second of poses confirms them
    queue.add(PoseSample{{}, t_ns - 600'000'000 * std::int64_t(2 - poses), {}, {}});
  }
  for (const auto& [kind, camera, events] : steps) {
    const Waiting one{camera, static_cast<std::size_t>(events), kind == 0 ? t_ns - 5 : ++t_ns};
    QueueCounts& counts = expected[camera];
    counts.received += kind == kTake ? 0 : one.events;
    if (kind != kTake) {
      if (kind == kPause) {
        queue.skip(camera, eventsUntil(one.t_ns, one.events));
        counts.fates[EventFate::kPaused] += one.events;
        if (one.events > 0) waiting.push_back({one.camera, 0, one.t_ns, true});
      } else {
        queue.add(packet(camera, one.t_ns, one.events));
        queue.add(PoseSample{{}, t_ns, {}, {}});
        ++poses;
        waiting.push_back(one);
      }
      while (sum(events_of) > static_cast<std::uint64_t>(options.max_queue_events) ||
             static_cast<double>(sum(bytes_of)) > options.max_queue_mb * 1e6) {
        expected[waiting.front().camera].fates[EventFate::kQueueFull] += waiting.front().events;
        miss(waiting.front());
        waiting.pop_front();
      }
    } else {
      const bool all_mapped = camera > 0;
      const InputQueue::Batch batch = queue.take(all_mapped);
      RC_ASSERT(batch.poses.size() == std::exchange(poses, 0));
      bool may_skip = all_mapped;  // skipped packets come first and end the batch
      for (const QueuedPacket& taken : batch.packets) {
        const Waiting next = waiting.front();
        waiting.pop_front();
        RC_ASSERT(may_skip || !next.skipped);
        may_skip = may_skip && next.skipped;
        RC_ASSERT(taken.camera == next.camera);
        RC_ASSERT(taken.events.size() == next.events);
        RC_ASSERT(taken.skipped_until_ns ==
                  (next.skipped ? std::optional(next.t_ns + 1) : std::nullopt));
        expected[next.camera].taken += next.events;
      }
      RC_ASSERT(waiting.empty() || waiting.front().skipped);
      RC_ASSERT(batch.missing.size() == missing_ns.size());
      for (const auto& [index, until_ns] : missing_ns) {
        RC_ASSERT(batch.missing.at(index).until_ns == until_ns);
      }
      missing_ns.clear();
    }
    RC_ASSERT(queue.queuedEvents() == sum(events_of));
    for (const auto& [index, of] : queue.counts()) {
      const QueueCounts& other = expected.at(index);
      RC_ASSERT(of.received == other.received);
      RC_ASSERT(of.fates[EventFate::kQueueFull] == other.fates[EventFate::kQueueFull]);
      RC_ASSERT(of.fates[EventFate::kPaused] == other.fates[EventFate::kPaused]);
      RC_ASSERT(of.taken == other.taken);
      RC_ASSERT(of.queued == of.received - of.fates[EventFate::kQueueFull] -
                                 of.fates[EventFate::kPaused] - of.taken);
    }
  }
}

/// A stream with pauses in random packets. A time far ahead follows some events and poses.
RC_GTEST_PROP(InputQueue, RejectsAloneWhatIsFarAheadOfItsStream, ()) {
  LiveOptions options;
  options.max_event_rate = *rc::gen::element(0.0, 1e9);
  InputQueue queue(options);
  const auto steps = *rc::gen::container<std::vector<std::tuple<std::int64_t, bool, bool>>>(
      rc::gen::tuple(rc::gen::element<std::int64_t>(1, 3'000'000'000), rc::gen::arbitrary<bool>(),
                     rc::gen::arbitrary<bool>()));
  std::vector<Event> next;
  std::vector<std::int64_t> expected{0};
  std::uint64_t wrong = 0;
  const auto add = [&](std::int64_t t_ns) {
    next.push_back({t_ns, 0, 0, true});
    queue.add(PoseSample{{}, t_ns, {}, {}});
  };
  add(0);
  for (const auto& [gap_ns, ends_packet, ahead] : steps) {
    expected.push_back(expected.back() + gap_ns);
    add(expected.back());
    if (ahead) add(expected.back() + 100'000'000'000);
    wrong += ahead ? 1 : 0;
    if (!ends_packet) continue;
    const std::int64_t until_ns = next.back().t_ns;  // may be far ahead, too
    queue.add({0, CheckedEvents(std::exchange(next, {})), until_ns});
  }
  for (int i = 0; i < 2; ++i) {  // so the last times are confirmed, too
    expected.push_back(expected.back() + 1);
    add(expected.back());
  }
  queue.add({0, CheckedEvents(next)});
  queue.end();
  const InputQueue::Batch batch = queue.take();
  std::vector<std::int64_t> events_ns;
  std::vector<std::int64_t> poses_ns;
  for (const EventPacket& one : batch.packets) {
    for (const Event& event : one.events) events_ns.push_back(event.t_ns);
    RC_ASSERT(one.complete_until_ns.value_or(0) <= expected.back());
  }
  for (const PoseSample& pose : batch.poses) poses_ns.push_back(pose.t_ns);
  RC_ASSERT(events_ns == expected);
  RC_ASSERT(poses_ns == expected);
  RC_ASSERT(queue.counts().at(0).fates[EventFate::kRejected] == wrong);
  RC_ASSERT(queue.rejectedPoses() == wrong);
}

// Exactly a burst of poses with wrong times is left out, with and without events beside the poses.
RC_GTEST_PROP(PoseIntake, LeavesOutABurstOfWrongTimesAlone, ()) {
  const auto length = *rc::gen::inRange<std::int64_t>(1, 1000);
  const auto at = *rc::gen::element<std::int64_t>(0, 2000, 4000);
  const auto shift_ns = *rc::gen::inRange<std::int64_t>(11'000, 400'000'000) * 1'000'000;
  const auto ahead_of_poses_ns = *rc::gen::element<std::int64_t>(0, 300'000'000);
  const auto has_events = *rc::gen::arbitrary<bool>();
  PoseIntake intake;
  std::vector<std::int64_t> good_ns, right_ns;
  const auto take = [&](const std::vector<PoseSample>& poses) {
    for (const PoseSample& pose : poses) right_ns.push_back(pose.t_ns);
  };
  for (std::int64_t i = 0; i < 4000 + length; ++i) {
    const std::int64_t t_ns = i * 1'000'000;
    const bool wrong = i >= at && i < at + length;
    if (!wrong) good_ns.push_back(t_ns);
    take(intake.add(PoseSample{{}, wrong ? t_ns + shift_ns : t_ns, {}, {}}));
    if (has_events && i % 10 == 0) take(intake.noteEvents(t_ns + ahead_of_poses_ns));
  }
  take(intake.finish());
  const bool same = right_ns == good_ns;  // not printed: long
  RC_ASSERT(same);
  RC_ASSERT(intake.wrongPoses() == static_cast<std::uint64_t>(length));
  RC_ASSERT(!intake.firstWrong().empty());
}

TEST(InputQueue, EndPassesTheHeldEvents) {
  LiveOptions options;
  options.max_event_rate = 1000;
  InputQueue queue(options);
  EXPECT_TRUE(queue.wait(InputQueue::Clock::now()).packets.empty()) << "it waits no longer";
  queue.add(packet(0, 5, 30));
  EXPECT_EQ(queue.counts().at(0).held, 30U);
  queue.end();
  queue.add(packet(0, 6, 30));  // an event that is too late
  const InputQueue::Batch batch = queue.wait();
  EXPECT_TRUE(batch.ended);
  ASSERT_EQ(batch.packets.size(), 2U);
  EXPECT_EQ(batch.packets[1].events.size(), 10U);
  EXPECT_EQ(queue.counts().at(0).fates[EventFate::kSubsampled], 20U);
  EXPECT_EQ(queue.counts().at(0).fates[EventFate::kAfterEnd], 30U);
  EXPECT_EQ(queue.counts().at(0).queued, 0U);
  queue.skip(0, eventsUntil(7, 5));
  EXPECT_EQ(queue.counts().at(0).fates[EventFate::kPaused], 5U);
  EXPECT_EQ(queue.counts().at(0).received, 65U);
  EXPECT_TRUE(queue.take().missing.empty()) << "after the end";
  queue.add(PoseSample{{}, 1, {}, {}});
  EXPECT_EQ(queue.rejectedPoses(), 1U);
  EXPECT_TRUE(queue.take().poses.empty());
}

}  // namespace
}  // namespace efm
