// SPDX-License-Identifier: BSD-3-Clause
// Live operation with input that cannot be used: nothing else is lost with it, and all is counted.
#include <gmock/gmock.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <future>
#include <map>
#include <memory>
#include <string>

#include "test/plugin/mrpt/live_driver.h"
#include "test/plugin/session/session_driver.h"

namespace efm {
namespace {

TEST(LiveLosses, WhatAHostsCallbacksThrowIsCountedAndToldOnce) {
  SyntheticRecording recording;
  recording.events[1].clear();  // the builder warns of its silence, within the first keyframe
  const Observations observations = observationsOf(recording);
  for (const bool log_throws : {false, true}) {
    CEventFusionMapBuilder builder(liveOptions());
    builder.logging_enable_console_output = false;
    std::vector<std::string> told;
    std::size_t thrown = 0;
    builder.logRegisterCallback([&](std::string_view text, auto&&...) {
      told.emplace_back(text);
      if (log_throws && ++thrown > 0) throw std::runtime_error("the log is full");
    });
    std::size_t keyframes = 0;
    builder.setKeyframeCallback([&](const KeyframeDepthMap&) {
      ++thrown;
      throw std::runtime_error("keyframe " + std::to_string(keyframes++));
    });
    std::size_t maps = 0;
    builder.setMapCallback([&](const auto&) {
      ++maps;
      ++thrown;
      throw 5;
    });
    playPatiently(builder, observations);

    EXPECT_EQ(keyframes, 3U) << "also after the log has thrown";
    EXPECT_GE(maps, 1U);
    const SessionStatus status = builder.status();
    EXPECT_EQ(builder.trajectory().size(), 3U);
    EXPECT_FALSE(status.live->failing);
    EXPECT_EQ(status.live->errors, thrown);
    const auto times = [&](const std::string& part) {
      return std::count_if(told.begin(), told.end(), [&](const std::string& text) {
        return text.find(part) != std::string::npos;
      });
    };
    EXPECT_EQ(times("camera 1 had no event"), 1);
    EXPECT_EQ(times("the callback of a keyframe: "), 1);
    EXPECT_EQ(times("the callback of the map: an exception of another type"), 1);
    EXPECT_EQ(times("the callback of the log: the log is full"), log_throws ? 1 : 0);
  }
}

TEST(LiveLosses, AHostMayDropItsLastReferenceInACallback) {
  const SyntheticRecording recording;
  const Observations observations = announced(recording, observationsOf(recording));
  for (const bool by_map : {false, true}) {
    auto builder = std::make_shared<CEventFusionMapBuilder>(liveOptions());
    builder->setVerbosityLevel(mrpt::system::LVL_ERROR);
    std::promise<void> fed;
    std::promise<void> dropped;
    std::shared_ptr<CEventFusionMapBuilder> last;
    int calls = 0;
    const auto drop = [&, may_drop = fed.get_future().share()] {
      if (++calls > 1) return;
      may_drop.wait();
      last.reset();
      dropped.set_value();
    };
    if (by_map) {
      builder->setMapCallback([&](const auto&) { drop(); });
    } else {
      builder->setKeyframeCallback([&](const auto&) { drop(); });
    }
    for (const auto& observation : observations) builder->processObservation(observation);
    last = std::move(builder);
    fed.set_value();
    dropped.get_future().wait();
    EXPECT_EQ(last, nullptr);
  }
}

TEST(LiveLosses, ChosenWindowsFillAtMostHalfOfTheQueue) {
  const SyntheticRecording recording(3);
  for (const bool is_announced : {true, false}) {
    EventFusionOptions options = liveOptions();
    options.automatic = defaultOptions().automatic;
    options.live.max_queue_events = 1000;
    CEventFusionMapBuilder builder(options);
    builder.setVerbosityLevel(mrpt::system::LVL_ERROR);
    const Observations observations = observationsOf(recording);
    playPatiently(builder, is_announced ? announced(recording, observations) : observations);

    const SessionStatus status = builder.status();
    expectSumsAgree(status);
    ASSERT_EQ(status.chosen.size(), 5U);
    double window_s = 0;
    std::string reason;
    for (const ChosenOption& option : status.chosen) {
      if (option.key == "window_s") window_s = option.value;
      if (option.key == "window_s") reason = option.reason;
    }
    EXPECT_THAT(reason, testing::StartsWith("no longer one fits into half of the queue of live "
                                            "operation; from "));
    const std::size_t from = reason.find("from ") + 5;
    const double length_s = std::stod(reason.substr(from));
    const double begin_s = std::stod(reason.substr(reason.find(" at ") + 4)) -
                           1e-9 * static_cast<double>(SyntheticRecording::kStartNs);
    const double events =
        static_cast<double>(pieceOf(recording, 0, begin_s, begin_s + length_s).events.size() +
                            pieceOf(recording, 1, begin_s, begin_s + length_s).events.size());
    EXPECT_NEAR(window_s * events / length_s, 500, 10) << reason;
    EXPECT_GT(builder.points()->size(), 30U);
    EXPECT_GT(static_cast<double>(builder.trajectory().size()), 2.7 / window_s);
    EXPECT_EQ(status.counts.windows_given_up.total(), 0U) << asText(status.counts.windows_given_up);
    EXPECT_EQ(status.live->dropRatio(), 0) << "whether the rig is known at once or not";
  }
}

/// A chosen window is shortened where the rate of events rises; a given one is an error.
TEST(LiveLosses, WindowsThatTheQueueCannotHoldAreShortenedOrAnError) {
  const SyntheticRecording recording(3);
  Observations observations = announced(recording, observationsOf(recording));
  for (std::size_t i = observations.size() / 2; i < observations.size(); ++i) {  // 4 times as many
    observations[i] = changed({observations[i]}, [](mrpt::obs::CObservation& copy) {
      CObservationEvents* packet = packetIn(copy);
      if (packet == nullptr) return;
      std::vector<Event> events;
      for (const Event& event : packet->events) events.insert(events.end(), 4, event);
      packet->events = events;
    })[0];
  }
  for (const bool is_chosen : {true, false}) {
    EventFusionOptions options = liveOptions();
    options.mapper.policy.window_s = options.mapper.policy.stride_s = is_chosen ? 0.2 : 0.5;
    if (is_chosen) options.automatic = defaultOptions().automatic;
    options.live.max_event_rate = 0;
    options.live.max_queue_events = 2000;
    CEventFusionMapBuilder builder(options);
    builder.logging_enable_console_output = false;
    std::vector<std::string> told;
    builder.logRegisterCallback([&](std::string_view text, auto&&...) { told.emplace_back(text); });
    playPatiently(builder, observations);

    const SessionStatus status = builder.status();
    expectSumsAgree(status);
    const WindowsGivenUp& given_up = status.counts.windows_given_up;
    if (is_chosen) {
      EXPECT_EQ(given_up.too_large + given_up.overload, 0U) << asText(given_up);
      EXPECT_EQ(status.live->errors, 0U);
      EXPECT_GT(status.choices, 1U);
      continue;
    }
    EXPECT_GE(status.counts.keyframes, 2U) << "while there were fewer events";
    EXPECT_GE(given_up.too_large, 2U) << asText(given_up);
    EXPECT_EQ(given_up.overload, 0U);
    EXPECT_GE(status.live->errors, 1U);
    EXPECT_THAT(
        status.live->too_large,
        testing::MatchesRegex("a window needs [0-9]+ events, the queue holds 2000: expected "
                              "smaller windows .*"));
    EXPECT_THAT(told, testing::Contains(testing::HasSubstr(status.live->too_large)));
  }
}

/// An event or a pose whose time is far ahead takes nothing else with it.
TEST(LiveLosses, WhatIsFarAheadIsRefusedAlone) {
  const Observations observations = observationsOf(SyntheticRecording(1.5));
  CEventFusionMapBuilder healthy(liveOptions());
  healthy.setVerbosityLevel(mrpt::system::LVL_ERROR);
  playPatiently(healthy, observations);
  for (const bool in_packet : {true, false}) {
    CEventFusionMapBuilder builder(liveOptions());
    builder.setVerbosityLevel(mrpt::system::LVL_ERROR);
    std::size_t events = 0;
    std::size_t poses = 0;
    Observations wrong;
    for (const auto& observation : observations) {
      if (wrong.size() % 50 < 2) {
        wrong.push_back(changed({observation}, [&](mrpt::obs::CObservation& copy) {
          CObservationEvents* packet = packetIn(copy);
          if (packet == nullptr) {
            copy.timestamp += std::chrono::seconds(100);
            ++poses;
          } else if (packet->events.size() > 2) {
            Event ahead = packet->events.back();
            ahead.t_ns += 100'000 * kMs;
            packet->events.insert(packet->events.end() - (in_packet ? 1 : 0), ahead);
            if (!in_packet && packet->covered_until_ns) packet->covered_until_ns = ahead.t_ns + 1;
            ++events;
          }
        })[0]);
        if (packetIn(*observation) != nullptr) continue;
      }
      wrong.push_back(observation);
    }
    playPatiently(builder, wrong);
    const SessionStatus status = builder.status();
    expectSumsAgree(status);
    std::uint64_t refused = 0;
    for (const auto& [camera, queue] : status.live->cameras) refused += queue.refused;
    EXPECT_GT(events, 1U);
    EXPECT_GT(poses, 1U);
    EXPECT_EQ(refused, events);
    EXPECT_EQ(status.live->refused_poses, poses);
    EXPECT_EQ(status.live->clock_steps, 0U);
    EXPECT_EQ(status.counts.windows_given_up.total(), 0U) << asText(status.counts.windows_given_up);
    EXPECT_EQ(keyframeTimes(builder), keyframeTimes(healthy));
    EXPECT_EQ(builder.points()->size(), healthy.points()->size());
  }
}

TEST(LiveLosses, AreToldWithTheirNumbers) {
  const SyntheticRecording recording;
  EventFusionOptions options = liveOptions();
  options.live.max_event_rate = 1000;  // 10 in 10 ms
  CEventFusionMapBuilder builder(options);
  builder.logging_enable_console_output = false;
  std::vector<std::string> told;
  builder.logRegisterCallback([&](std::string_view text, auto&&...) { told.emplace_back(text); });
  auto packet = packetObservation(recording, 1);
  packet->timestamp = mrptTimeFrom(SyntheticRecording::kStartNs);
  for (int i = 0; i < 33; ++i) packet->events.push_back({i, 1, 1, true});
  packet->events.push_back({20 * kMs, 1, 1, true});
  feedPatiently(builder, {packetObservation(recording, 0), packet});
  builder.finish();
  ASSERT_FALSE(told.empty());
  EXPECT_EQ(told[0],
            "so far 0 windows given up; camera 0: 0 dropped, 0 thinned, 0 refused, 0 lost "
            "afterwards, of 0 events; camera 1: 0 dropped, 23 thinned, 0 refused, 0 lost "
            "afterwards, of 34 events");
}

TEST(LiveLosses, EventsThatWaitAreBoundedInNumberAndMemory) {
  const SyntheticRecording recording(1.5);
  const Observations observations = announced(recording, observationsOf(recording));
  for (const bool by_memory : {false, true}) {
    EventFusionOptions options = liveOptions();
    options.live.max_pose_wait_s = 3600;
    (by_memory ? options.live.max_queue_mb : options.live.max_event_rate) = by_memory ? 0.016 : 0;
    if (!by_memory) options.live.max_queue_events = 1000;
    CEventFusionMapBuilder builder(options);
    builder.setVerbosityLevel(mrpt::system::LVL_ERROR);
    std::uint64_t most = 0;
    for (const auto& observation : observations) {
      const std::int64_t t_ns = nanosecondsFrom(observation->timestamp);
      const bool lost = t_ns > SyntheticRecording::kStartNs + 300 * kMs;
      if (observation->sensorLabel == "pose" && lost) continue;  // the others wait for it
      feedPatiently(builder, {observation});
      const EventCounts all = builder.status().counts.total();
      most =
          std::max(most, all.read - all.used - all.without_pose - all.outside_window - all.dropped);
    }
    EXPECT_GT(most, 900U) << by_memory;
    EXPECT_LT(most, 1100U) << "and a packet or two: " << by_memory;
    builder.finish();
    expectSumsAgree(builder.status());
    EXPECT_GT(builder.status().counts.windows_given_up.overload, 2U);
    EXPECT_GT(builder.status().live->dropRatio(), 0.3);
  }
}

/// Each observation may be late, wrong or lost, whatever the schedule of the mapping's thread.
RC_GTEST_PROP(LiveLosses, EachEventHasOneFate, ()) {
  static const SyntheticRecording recording(0.7);
  static const Observations observations = observationsOf(recording);
  enum { kLate = 1, kOutside, kOtherLens, kOlder, kPaused, kLost, kJump, kTwice, kAhead, kKinds };
  const auto faults = *rc::gen::container<std::vector<int>>(
      7, rc::gen::weightedOneOf<int>({{3, rc::gen::just(0)}, {1, rc::gen::inRange(1, +kKinds)}}));
  EventFusionOptions options = liveOptions();
  options.mapper.keyframe.planes.num_planes = 4;
  options.mapper.keyframe.sweep.threads = 1;
  options.live.max_event_rate = *rc::gen::element(0.0, 1000.0);
  options.live.max_queue_events = *rc::gen::element(1000, 5'000'000);
  options.live.max_queue_mb = *rc::gen::element(0.02, 256.0);
  options.live.max_pose_wait_s = 0.2;
  options.automatic.window_s = options.automatic.stride_s = *rc::gen::arbitrary<bool>();
  CEventFusionMapBuilder builder(options);
  builder.logging_enable_console_output = false;
  std::map<int, std::uint64_t> fed;
  double away_m = 0;
  for (std::size_t i = 0; i < observations.size(); ++i) {
    const int fault = faults[i % faults.size()];
    away_m += fault == kJump ? 10 : 0;
    const auto observation = changed({observations[i]}, [&](mrpt::obs::CObservation& copy) {
      auto* pose = dynamic_cast<mrpt::obs::CObservationRobotPose*>(&copy);
      if (pose != nullptr) pose->pose.mean.y_incr(away_m);
      CObservationEvents* packet = packetIn(copy);
      if (packet == nullptr) return;
      const std::int64_t t_ns = nanosecondsFrom(packet->timestamp);
      if (fault == kLate) packet->events.push_back({t_ns - 30 * kMs, 3, 3, true});
      if (fault == kOutside) packet->events.push_back({t_ns, 120, 3, true});
      if (fault == kAhead) packet->events.push_back({t_ns + 3600 * 1000 * kMs, 3, 3, true});
      if (fault == kOtherLens) packet->camera.fx = 99;
      if (fault != kOlder) return;
      packet->covered_until_ns.reset();
      for (Event& event : packet->events) event.t_ns -= 5000 * kMs;
    })[0];
    builder.enableMapUpdating(fault != kPaused);
    for (int times = fault == kTwice ? 2 : fault == kLost ? 0 : 1; times > 0; --times) {
      const CObservationEvents* packet = packetIn(*observation);
      if (packet != nullptr) fed[packet->camera_index] += packet->events.size();
      messageOf([&] { builder.processObservation(observation); });
    }
  }
  builder.finish();
  const SessionStatus status = builder.status();
  expectSumsAgree(status);
  RC_ASSERT(!testing::Test::HasFailure());
  std::uint64_t received = 0;
  std::uint64_t kept = 0;
  for (const auto& [camera, queue] : status.live->cameras) {
    RC_ASSERT(queue.received == fed[camera]);
    RC_ASSERT(queue.held + queue.queued == 0U);
    const EventCounts counts = countsOf(status, camera);
    received += queue.received;
    kept += counts.used + counts.outside_window + queue.paused;
  }
  RC_ASSERT(std::abs(status.live->dropRatio() * static_cast<double>(received) -
                     static_cast<double>(received - kept)) < 0.5);
}

TEST(LiveLosses, LatePosesAndInputAfterTheEndAreCounted) {
  const Observations observations = observationsOf(SyntheticRecording());
  CEventFusionMapBuilder builder(liveOptions());
  builder.setVerbosityLevel(mrpt::system::LVL_ERROR);
  feedPatiently(builder, observations);
  feedPatiently(builder, changed({observations[2]}, [](mrpt::obs::CObservation& pose) {
                  pose.timestamp -= std::chrono::seconds(9);
                }));
  builder.finish();
  EXPECT_EQ(builder.status().live->refused_poses, 1U);
  EXPECT_THAT(builder.status().live->last_error, testing::HasSubstr("the pose at 1.0"));
  const std::size_t points = builder.points()->size();
  std::uint64_t events = 0;
  std::uint64_t poses = 0;
  for (const auto& observation : observations) {
    const CObservationEvents* packet = packetIn(*observation);
    if (packet != nullptr) events += packet->events.size();
    if (packet == nullptr) ++poses;
    builder.processObservation(observation);
  }
  const SessionStatus status = builder.status();
  EXPECT_EQ(status.live->cameras.at(0).after_end + status.live->cameras.at(1).after_end, events);
  EXPECT_EQ(status.live->refused_poses, 1 + poses);
  EXPECT_EQ(builder.points()->size(), points);
  EXPECT_DOUBLE_EQ(status.live->dropRatio(), 0.5);
  expectSumsAgree(status);
}

TEST(LiveLosses, OdometryWaitsForEventsTenMinutes) {
  const SyntheticRecording recording(1.3);
  const PoseSourceId wheels{PoseKind::kOdometry, "wheels"};
  MappingSession session(liveOptions());
  std::size_t keyframes = 0;
  for (std::int64_t ago_s = 7200; ago_s > 0; --ago_s) {  // a time in the future among them
    const std::int64_t t_ns = SyntheticRecording::kStartNs - ago_s * 1000 * kMs;
    session.addPose(
        sampleOf({ago_s == 5000 ? -t_ns : t_ns, recording.poses.front().T_world_rig}, wheels));
    EXPECT_FALSE(session.next());
  }
  for (const StampedPose& pose : recording.poses) session.addPose(sampleOf(pose, wheels));
  addEvents(session, recording);
  session.finish();
  while (session.next()) ++keyframes;
  EXPECT_EQ(keyframes, 11U);
  // The one at 1 s before the start was the last that came alone.
  EXPECT_EQ(session.status().poses->first_ns, SyntheticRecording::kStartNs - 601'000 * kMs);
}

}  // namespace
}  // namespace efm
