// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/session/gate.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <deque>
#include <functional>
#include <map>
#include <numeric>
#include <string>
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

RC_GTEST_PROP(Gate, KeepsTheNewestPacketsThatFitIntoEventsAndMemoryAndAllPoses, ()) {
  LiveOptions options;
  options.max_event_rate = 0;
  options.max_queue_events = *rc::gen::inRange(1, 200);
  const std::size_t fit = *rc::gen::inRange<std::size_t>(1, 10);
  const std::size_t events_that_fit = *rc::gen::inRange<std::size_t>(0, 100);
  options.max_queue_mb =
      1e-6 * static_cast<double>(fit * sizeof(EventPacket) + events_that_fit * sizeof(Event));
  Gate gate(options);
  struct Waiting {
    int camera;
    std::size_t events;
    std::int64_t t_ns;
  };
  std::deque<Waiting> waiting;
  std::map<int, std::int64_t> missing_ns;
  std::map<int, QueueCounts> expected;
  std::size_t poses = 0;
  std::size_t skipped = 0;
  const auto sum = [&](auto of) {
    return std::accumulate(
        waiting.begin(), waiting.end(), std::uint64_t{0},
        [&](std::uint64_t total, const Waiting& one) { return total + of(one); });
  };
  const auto events_of = [](const Waiting& one) { return one.events; };
  const auto bytes_of = [](const Waiting& one) {
    return sizeof(EventPacket) + one.events * sizeof(Event);
  };
  enum { kTake = 8, kPause };
  const auto steps = *rc::gen::container<std::vector<std::tuple<int, int, int>>>(rc::gen::tuple(
      rc::gen::inRange(0, kPause + 1), rc::gen::inRange(0, 3), rc::gen::inRange(0, 90)));
  std::int64_t t_ns = 2'000'000'000;
  for (int camera = 0; camera < 3; ++camera) {  // 20 ms of events, and a second of poses,
    std::vector<Event> first;                   // confirm a stream
    for (int ms = 0; ms <= 20; ++ms) first.push_back({t_ns - (20 - ms) * 1'000'000, 0, 0, true});
    gate.add({camera, CheckedEvents(first)});
    expected[camera].received = first.size();
    expected[camera].taken = first.size();
  }
  for (int i = 0; i < 3; ++i) gate.add(PoseSample{{}, t_ns - 600'000'000 * (2 - i), {}, {}});
  while (gate.take(kMaxTimeNs)) {
  }
  for (auto& [camera, counts] : expected) {  // some may have been dropped at once
    counts = gate.counts().at(camera);
  }
  for (const auto& [kind, camera, events] : steps) {
    const Waiting one{camera, static_cast<std::size_t>(events), kind == 0 ? t_ns - 5 : ++t_ns};
    QueueCounts& counts = expected[camera];
    counts.received += kind == kTake ? 0 : one.events;
    if (kind == kPause) {
      gate.skip(camera, eventsUntil(one.t_ns, one.events));
      counts.fates[QueueFate::kPaused] += one.events;
      skipped += one.events > 0 ? 1 : 0;
    } else if (kind != kTake) {
      gate.add(packet(camera, one.t_ns, one.events));
      gate.add(PoseSample{{}, t_ns, {}, {}});
      ++poses;
      waiting.push_back(one);
      while (sum(events_of) > static_cast<std::uint64_t>(options.max_queue_events) ||
             static_cast<double>(sum(bytes_of)) > options.max_queue_mb * 1e6) {
        const Waiting& oldest = waiting.front();
        expected[oldest.camera].fates[QueueFate::kQueueFull] += oldest.events;
        if (oldest.events > 0) {
          std::int64_t& until_ns = missing_ns.try_emplace(oldest.camera, kMinTimeNs).first->second;
          until_ns = std::max(until_ns, oldest.t_ns + 1);
        }
        waiting.pop_front();
      }
    } else {
      while (const std::optional<Input> input = gate.take(kMaxTimeNs)) {
        if (std::holds_alternative<PoseSample>(*input)) --poses;
        if (const auto* missing = std::get_if<Missing>(&*input)) {
          if (missing->reason == DropReason::kPaused) {
            --skipped;
            continue;
          }
          RC_ASSERT(missing_ns.at(missing->camera) == missing->until_ns);
          missing_ns.erase(missing->camera);
        }
        const auto* const taken = std::get_if<EventPacket>(&*input);
        if (!taken) continue;
        RC_ASSERT(missing_ns.empty());  // they are older
        RC_ASSERT(taken->camera == waiting.front().camera);
        RC_ASSERT(taken->events.size() == waiting.front().events);
        expected[taken->camera].taken += taken->events.size();
        waiting.pop_front();
      }
      const bool all = poses == 0 && skipped == 0 && waiting.empty() && missing_ns.empty();
      RC_ASSERT(all);
    }
    RC_ASSERT(gate.queuedEvents() == sum(events_of));
    for (auto& [index, of_camera] : expected) {
      const QueueCounts counted = gate.counts()[index];
      RC_ASSERT(counted.received == of_camera.received);
      RC_ASSERT(counted.taken == of_camera.taken);
      RC_ASSERT(counted.fates == of_camera.fates);
    }
  }
}

/// A sensor that sends events each millisecond and poses each 5 ms, in packets of 10 ms.
struct Sensor {
  explicit Sensor(const LiveOptions& options = {}) : gate(options) {}

  /// @param change_event, change_pose change what is sent at a time.
  template <typename ChangeEvent, typename ChangePose>
  void send(int ms, const ChangeEvent& change_event, const ChangePose& change_pose) {
    for (const int end_ms = now_ms + ms; now_ms < end_ms; now_ms += 10) {
      std::vector<Event> sent;
      for (int k = 0; k < 10; ++k) {
        Event event{kMs * (now_ms + k), 0, 0, true};
        change_event(now_ms + k, event);
        sent.push_back(event);
      }
      gate.add({0, CheckedEvents(sent)});
      for (int k = 5; k <= 10; k += 5) {
        PoseSample pose{{}, kMs * (now_ms + k), {}, {}};
        pose.T_world_body.translation.x() = 0.001 * (now_ms + k);
        change_pose(now_ms + k, pose);
        gate.add(pose);
      }
      if (takes_at_once) take();
    }
  }
  void take() {
    while (const std::optional<Input> input = gate.take(newest_ns - 10 * kMs)) note(*input);
  }
  void note(const Input& input) {
    if (const auto* packet = std::get_if<EventPacket>(&input)) {
      for (const Event& event : packet->events) {
        newest_ns = event.t_ns;
        ++events;
      }
    }
    if (std::holds_alternative<PoseSample>(input)) ++poses;
    if (const auto* jump = std::get_if<Jump>(&input)) {
      text += "jump " + std::to_string(jump->before_ns / kMs) + " " +
              std::to_string(jump->after_ns / kMs) + " at " + std::to_string(poses) + "; ";
    }
    if (std::holds_alternative<ClockReset>(input)) {
      text += "reset at " + std::to_string(poses) + "; ";
      newest_ns = kMinTimeNs + kMaxEventDelayNs;
    }
  }

  static constexpr std::int64_t kMs = 1'000'000;
  Gate gate;
  bool takes_at_once = true;
  int now_ms = 0;
  std::int64_t newest_ns = kMinTimeNs + kMaxEventDelayNs;
  int events = 0, poses = 0;  // that passed
  std::string text;           // the breaks
};

/// Faults from 3 s on, as live hosts met them. Each row has what does not pass, and the breaks.
TEST(Gate, LeavesOutWhatIsWrongAloneAndFindsTheBreaks) {
  using Row = struct {
    const char* what;
    int wrong_events, wrong_poses;
    const char* breaks;
    std::function<void(int ms, Event&)> event;
    std::function<void(int ms, PoseSample&)> pose;
  };
  const auto shifted = [](int from_ms, int until_ms, std::int64_t shift_ms) {
    return [=](int ms, auto& one) {
      if (ms >= from_ms && ms < until_ms) one.t_ns += shift_ms * Sensor::kMs;
    };
  };
  const auto away = [](int each_ms, int for_ms, double m) {
    return [=](int ms, PoseSample& pose) {
      if (ms >= 3000 && ms < 5000 && ms % each_ms < for_ms) pose.T_world_body.translation.y() += m;
    };
  };
  const auto none = [](int, auto&) {};
  const Row rows[] = {
      {"nothing", 0, 0, "", none, none},
      {"one event 0.9 s ahead", 1, 0, "", shifted(3000, 3001, 900), none},
      {"two events 100 s ahead", 2, 0, "", shifted(3000, 3002, 100'000), none},
      {"15 events 100 s ahead", 15, 0, "", shifted(3000, 3015, 100'000), none},
      {"15 events 100 s behind", 15, 0, "", shifted(3003, 3018, -100'000), none},
      {"the first events 100 s ahead", 15, 0, "", shifted(0, 15, 100'000), none},
      {"the last events 100 s ahead", 15, 0, "", shifted(7985, 8000, 100'000), none},
      {"two poses 100 s ahead", 0, 2, "", none, shifted(3000, 3010, 100'000)},
      {"50 poses 100 s ahead", 0, 50, "", none, shifted(3000, 3250, 100'000)},
      {"the first poses 100 s ahead", 0, 50, "", none, shifted(0, 255, 100'000)},
      {"one pose in 200 off by 60 m", 0, 2, "", none, away(1000, 5, 60)},
      {"one pose in 100 off by 2 m", 0, 4, "", none, away(500, 5, 2)},
      {"50 poses off by 60 m", 0, 100, "", none, away(1000, 250, 60)},
      {"the tracker jumps", 0, 0, "jump 2995 3000 at 599; ", none,
       [](int ms, PoseSample& pose) {
         if (ms >= 3000) pose.T_world_body.translation.y() += 60;
       }},
      {"the tracker jumps for a second", 0, 0, "jump 2995 3000 at 599; jump 3995 4000 at 799; ",
       none,
       [](int ms, PoseSample& pose) {
         if (ms >= 3000 && ms < 4000) pose.T_world_body.translation.y() += 60;
       }},
      // A second of each sensor, until it is certain. Its last data may be late, too.
      {"all clocks go back", 0, 0, "reset at 599; ", shifted(3000, 8000, -2500),
       shifted(3000, 8001, -2500)},
  };
  for (const Row& row : rows) {
    std::string texts[2];
    for (const bool takes_at_once : {true, false}) {
      LiveOptions options;
      options.max_event_rate = 1e6;
      Sensor sensor(options);
      sensor.takes_at_once = takes_at_once;
      sensor.send(8000, row.event, row.pose);
      sensor.gate.end();
      sensor.take();
      sensor.newest_ns = kMaxTimeNs;
      sensor.take();
      EXPECT_TRUE(sensor.gate.isAtEnd());
      EXPECT_EQ(sensor.text, row.breaks) << row.what;
      EXPECT_EQ(8000 - sensor.events, row.wrong_events) << row.what;
      EXPECT_EQ(1600 - sensor.poses, row.wrong_poses) << row.what;
      EXPECT_EQ(sensor.gate.rejectedPoses(), std::uint64_t(row.wrong_poses)) << row.what;
      texts[takes_at_once] = sensor.text;
    }
    EXPECT_EQ(texts[0], texts[1]) << row.what;
  }
}

/// A sensor whose clock stands still must not fill the memory.
TEST(Gate, WhatWaitsIsBoundedIfAClockStandsStill) {
  for (const int stands_at_ms : {-100'000, 100'000, 3001}) {  // behind, ahead, away
    Sensor sensor;
    sensor.send(
        3000, [](int, auto&) {}, [](int, auto&) {});
    const int healthy = sensor.poses;
    for (int i = 0; i < 30'000; ++i) {
      PoseSample pose{{}, Sensor::kMs * stands_at_ms, {}, {}};
      pose.T_world_body.translation.x() = 60;
      sensor.gate.add(pose);
    }
    sensor.newest_ns = kMaxTimeNs;  // the events go on
    sensor.take();
    EXPECT_GE(sensor.poses - healthy + int(sensor.gate.rejectedPoses()), 20'000) << stands_at_ms;
  }
}

/// The limits are 10 m/s and 100 degrees/s plus five standard deviations of the stated noise.
TEST(Gate, AJumpIsAMotionThatNothingExplains) {
  const struct {
    int after_ms;
    double m, degrees;
    PoseNoise noise;
    bool is_jump;
  } rows[] = {
      {100, 0.99, 0, {}, false},
      {100, 1.01, 0, {}, true},
      {100, 1.01, 0, {0.01, 0}, false},
      {100, 1.06, 0, {0.01, 0}, true},
      {100, 0, 9.9, {}, false},
      {100, 0, 10.1, {}, true},
      {100, 0, -10.1, {}, true},
      {100, 0, 10.1, {0, 0.001}, false},
      {200, 1.9, 19, {}, false},
      {0, 5, 0, {}, false},    // the mapper handles a second pose of the same time
      {-50, 5, 0, {}, false},  // and an earlier pose
  };
  for (const auto& row : rows) {
    LiveOptions options;
    options.max_speed_m_s = 10;
    options.max_turn_deg_s = 100;
    Gate gate(options);
    constexpr std::int64_t kMs = 1'000'000;
    const auto add = [&](std::int64_t ms, double m, double degrees, PoseNoise noise) {
      PoseSample pose{{}, ms * kMs, {}, {}, noise};
      pose.T_world_body.translation.x() = m;
      pose.T_world_body.rotation =
          Eigen::AngleAxisd(degrees * kRadiansPerDegree, Eigen::Vector3d::UnitY());
      gate.add(pose);
    };
    for (std::int64_t ms = -2000; ms <= 0; ms += 500) add(ms, 0, 0, {});
    add(row.after_ms, row.m, row.degrees, row.noise);
    for (std::int64_t ms = 50; ms <= 1000 && row.after_ms > 0; ms += 50) {
      add(row.after_ms + ms, row.m, row.degrees, row.noise);
    }
    gate.end();
    bool jumps = false;
    while (const std::optional<Input> input = gate.take(kMaxTimeNs)) {
      jumps = jumps || std::holds_alternative<Jump>(*input);
    }
    EXPECT_EQ(jumps, row.is_jump) << row.after_ms << " ms, " << row.m << " m, " << row.degrees;
    EXPECT_EQ(gate.rejectedPoses(), 0U);
  }
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

TEST(Gate, EndPassesTheHeldEvents) {
  LiveOptions options;
  options.max_event_rate = 1000;
  Gate gate(options);
  gate.wait(Gate::Clock::now());  // no longer
  EXPECT_FALSE(gate.take(0));
  gate.add(packet(0, 5, 30));
  EXPECT_EQ(gate.counts().at(0).held, 30U);
  gate.end();
  gate.add(packet(0, 6, 30));  // an event that is too late
  gate.wait();
  const std::optional<Input> packets[] = {gate.take(0), gate.take(0), gate.take(0)};
  std::size_t events = 0;
  for (const auto& one : packets) {
    if (one) events += std::get<EventPacket>(*one).events.size();
  }
  EXPECT_TRUE(gate.isAtEnd());
  EXPECT_EQ(events, 10U);
  EXPECT_EQ(gate.counts().at(0).fates[QueueFate::kSubsampled], 20U);
  EXPECT_EQ(gate.counts().at(0).fates[QueueFate::kAfterEnd], 30U);
  EXPECT_EQ(gate.counts().at(0).queued, 0U);
  gate.skip(0, eventsUntil(7, 5));
  EXPECT_EQ(gate.counts().at(0).fates[QueueFate::kPaused], 5U);
  EXPECT_EQ(gate.counts().at(0).received, 65U);
  gate.add(PoseSample{{}, 1, {}, {}});
  EXPECT_EQ(gate.rejectedPoses(), 1U);
  EXPECT_FALSE(gate.take(0)) << "after the end";
}

}  // namespace
}  // namespace efm
