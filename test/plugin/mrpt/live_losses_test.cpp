// SPDX-License-Identifier: BSD-3-Clause
// Live operation with input that cannot be used: nothing else is lost with it, and all is counted.
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <iterator>
#include <map>
#include <string>

#include "test/plugin/mrpt/live_driver.h"
#include "test/plugin/session/session_driver.h"

namespace efm {
namespace {

using mrpt::obs::CObservation;

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
    // Of the two that one keyframe's callback throws, the builder passes on one.
    EXPECT_EQ(status.live->errors + (log_throws ? 1 : 0), thrown);
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

TEST(LiveLosses, OptionsAreChosenFromWhatIsThereWhereTheQueueIsFull) {
  const SyntheticRecording recording(3);  // some 2000 events per second
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
    EXPECT_GT(window_s, 0.05);
    EXPECT_LT(window_s, is_announced ? 0.35 : 0.55) << "two fit into the queue; " << reason;
    EXPECT_GT(builder.points()->size(), 30U);
    const double mapped_s = 3 - (is_announced ? 0 : 1);  // without a second for further cameras
    EXPECT_GT(static_cast<double>(builder.trajectory().size()), (mapped_s - 0.3) / window_s);
    if (is_announced) {
      EXPECT_EQ(status.counts.windows_given_up.total(), 0U)
          << asText(status.counts.windows_given_up);
      EXPECT_EQ(status.live->dropRatio(), 0);
    } else {
      EXPECT_GT(status.live->dropRatio(), 0.02);
      EXPECT_LT(status.live->dropRatio(), 0.5);
    }
  }
}

TEST(LiveLosses, GivenUpWindowsAreCountedByReasonAndTheirEventsAreLost) {
  const SyntheticRecording recording(2);
  const Observations healthy = observationsOf(recording);
  const auto secondsOf = [](const CObservation& observation) {
    return 1e-9 * static_cast<double>(nanosecondsFrom(observation.timestamp) -
                                      SyntheticRecording::kStartNs);
  };
  const Observations jumping = changed(healthy, [&](CObservation& observation) {
    auto* pose = dynamic_cast<mrpt::obs::CObservationRobotPose*>(&observation);
    if (pose != nullptr && secondsOf(observation) > 1.045) pose->pose.mean.x_incr(10);
  });
  Observations lost;
  for (const auto& observation : healthy) {
    const double t_s = secondsOf(*observation);
    if (packetIn(*observation) != nullptr || t_s < 0.905 || t_s > 1.745)
      lost.push_back(observation);
  }
  struct FailingSink : DsiSink {
    void addPlane(int plane, const float* /*values*/) override {
      if (plane == 0 && ++keyframes % 4 == 0) throw std::runtime_error("disk full");
    }
    std::atomic<int> keyframes{0};
  } sink;
  struct Case {
    GiveUpReason reason;
    std::uint64_t windows;
    Observations observations;
    DsiSink* sink;
  };
  // Windows of 0.1 s, one after the other: 19 that are full.
  const Case cases[] = {{&WindowsGivenUp::jump, 1, jumping, nullptr},
                        {&WindowsGivenUp::no_pose, 7, lost, nullptr},
                        {&WindowsGivenUp::error, 4, healthy, &sink}};
  for (const Case& test : cases) {
    EventFusionOptions options = liveOptions();
    options.mapper.policy.window_s = options.mapper.policy.stride_s = 0.1;
    options.live.max_pose_wait_s = 0.3;
    CEventFusionMapBuilder builder(options);
    builder.setVerbosityLevel(mrpt::system::LVL_ERROR);
    builder.setDsiSink(test.sink);
    playPatiently(builder, test.observations);

    const SessionStatus status = builder.status();
    const WindowsGivenUp& windows = status.counts.windows_given_up;
    EXPECT_EQ(windows.*test.reason, test.windows) << asText(windows);
    EXPECT_EQ(windows.total(), test.windows) << asText(windows);
    const std::uint64_t not_mapped = test.windows + status.counts.keyframes_without_pose;
    EXPECT_EQ(builder.trajectory().size() + not_mapped, 19U);
    EXPECT_EQ(status.counts.keyframes, builder.trajectory().size());
    expectSumsAgree(status);
    // The motion is even: a window has a twentieth of the events.
    EXPECT_NEAR(status.live->dropRatio(), 0.05 * static_cast<double>(not_mapped), 0.04)
        << asText(windows);
  }
}

TEST(LiveLosses, DropsAreRememberedUntilTheCamerasNextPacketAndNotLonger) {
  const SyntheticRecording recording(2.5);
  const std::int64_t start_ns = SyntheticRecording::kStartNs;
  constexpr std::int64_t kHourNs = 3'600'000 * kMs;
  for (const std::int64_t wrong_ns : {std::int64_t{0}, kHourNs, -kHourNs}) {
    MappingSession session(liveOptions());
    std::vector<Window> windows;
    std::vector<std::size_t> begin(2, 0);
    for (const StampedPose& pose : recording.poses) {
      session.addPose(pose);
      for (std::size_t c = 0; c < 2; ++c) {
        const int camera = static_cast<int>(c);
        CameraPacket packet{camera, recording.cameras[c], {}, std::nullopt};
        const std::vector<Event>& events = recording.events[c];
        for (; begin[c] < events.size() && events[begin[c]].t_ns < pose.t_ns; ++begin[c]) {
          packet.events.push_back(events[begin[c]]);
        }
        // Camera 1 has its first packet after 0.3 s; the one of camera 0 is dropped at 1.25 s.
        const bool early = c == 1 && pose.t_ns <= start_ns + 300 * kMs;
        const bool dropped = c == 0 && pose.t_ns == start_ns + 1250 * kMs;
        if (early || dropped) {
          session.noteMissing(camera, {pose.t_ns + (dropped ? wrong_ns : 0)});
        } else {
          session.addEvents(std::move(packet));
        }
      }
      while (const auto keyframe = session.next()) windows.push_back(keyframe->window);
    }
    session.finish();
    while (const auto keyframe = session.next()) windows.push_back(keyframe->window);

    ASSERT_FALSE(windows.empty());
    EXPECT_GE(windows.front().t0_ns, start_ns + 300 * kMs);
    // Windows of 0.2 s, every 0.1 s: two have the packet. An hour ago is in none.
    const WindowsGivenUp& given_up = session.status().counts.windows_given_up;
    EXPECT_EQ(given_up.overload, wrong_ns < 0 ? 0U : 2U) << wrong_ns;
    EXPECT_EQ(windows.size() + given_up.total(), 20U);
  }
}

TEST(LiveLosses, InputAfterTheEndIsCounted) {
  const Observations observations = observationsOf(SyntheticRecording());
  CEventFusionMapBuilder builder(liveOptions());
  playPatiently(builder, observations);
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
  EXPECT_EQ(status.live->refused_poses, poses);
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
    session.addPose({ago_s == 5000 ? -t_ns : t_ns, recording.poses.front().T_world_rig}, wheels);
    EXPECT_FALSE(session.next());
  }
  for (const StampedPose& pose : recording.poses) session.addPose(pose, wheels);
  addEvents(session, recording);
  session.finish();
  while (session.next()) ++keyframes;
  EXPECT_EQ(keyframes, 11U);
  // The one at 1 s before the start was the last that came alone.
  EXPECT_EQ(session.status().poses->first_ns, SyntheticRecording::kStartNs - 601'000 * kMs);
}

/// Feeds a recording with random faults. @return the events that were fed, by camera.
std::map<int, std::uint64_t> playWithFaults(CEventFusionMapBuilder& builder,
                                            const SyntheticRecording& recording,
                                            const Observations& observations,
                                            const std::vector<int>& faults) {
  enum {
    kLate = 1,
    kOutside,
    kOtherLens,
    kOlder,
    kPaused,
    kLost,
    kJump,
    kNewCamera,
    kTwice,
    kAhead
  };
  std::map<int, std::uint64_t> fed;
  double away_m = 0;
  for (std::size_t i = 0; i < observations.size(); ++i) {
    const int fault = faults[i % faults.size()];
    if (fault == kLost) continue;
    if (fault == kJump) away_m += 10;
    const auto observation = changed({observations[i]}, [&](CObservation& copy) {
      auto* pose = dynamic_cast<mrpt::obs::CObservationRobotPose*>(&copy);
      if (pose != nullptr) pose->pose.mean.y_incr(away_m);
      CObservationEvents* packet = packetIn(copy);
      if (packet == nullptr) return;
      const std::int64_t t_ns = nanosecondsFrom(packet->timestamp);
      if (fault == kLate) packet->events.push_back({t_ns - 30 * kMs, 3, 3, true});
      if (fault == kOutside) packet->events.push_back({t_ns, 120, 3, true});
      if (fault == kAhead) packet->events.push_back({t_ns + 3600 * 1000 * kMs, 3, 3, true});
      if (fault == kOtherLens) packet->camera.fx = 99;
      if (fault == kNewCamera) packet->camera_index = 3;
      if (fault != kOlder) return;
      packet->covered_until_ns.reset();
      for (Event& event : packet->events) event.t_ns -= 5000 * kMs;
    })[0];
    builder.enableMapUpdating(fault != kPaused);
    for (int times = fault == kTwice ? 2 : 1; times > 0; --times) {
      const CObservationEvents* packet = packetIn(*observation);
      if (packet != nullptr) fed[packet->camera_index] += packet->events.size();
      try {
        builder.processObservation(observation);
      } catch (const std::invalid_argument&) {
      }
    }
  }
  try {
    builder.finish();
  } catch (const std::invalid_argument&) {  // camera 3 waits for camera 2
  }
  const auto late = packetObservation(recording, 0);
  late->events = recording.events[0];
  builder.processObservation(late);
  fed[0] += late->events.size();
  return fed;
}

RC_GTEST_PROP(LiveLosses, EachEventHasOneFateWhateverHappens, ()) {
  static const SyntheticRecording recording(0.7);
  static const Observations observations = observationsOf(recording);
  const auto faults = *rc::gen::container<std::vector<int>>(
      7, rc::gen::weightedOneOf<int>({{3, rc::gen::just(0)}, {1, rc::gen::inRange(0, 11)}}));
  EventFusionOptions options = liveOptions();
  options.mapper.keyframe.planes.num_planes = 4;
  options.mapper.keyframe.sweep.threads = 1;
  options.live.max_event_rate = *rc::gen::element(0.0, 1000.0);
  options.live.max_queue_events = *rc::gen::element(1000, 5'000'000);
  options.live.max_pose_wait_s = 0.2;
  if (*rc::gen::arbitrary<bool>()) options.automatic.window_s = options.automatic.stride_s = true;
  CEventFusionMapBuilder builder(options);
  builder.setVerbosityLevel(mrpt::system::LVL_ERROR);
  builder.logging_enable_console_output = false;
  const auto fed = playWithFaults(builder, recording, observations, faults);

  const SessionStatus status = builder.status();
  std::uint64_t received = 0;
  std::uint64_t kept = 0;
  for (const auto& [camera, queue] : status.live->cameras) {
    RC_ASSERT(queue.received == (fed.count(camera) != 0 ? fed.at(camera) : 0));
    RC_ASSERT(queue.held + queue.queued == 0U);
    const auto index = static_cast<std::size_t>(camera);
    const EventCounts counts =
        index < status.counts.cameras.size() ? status.counts.cameras[index] : EventCounts{};
    const auto refused = status.refused_events.find(camera);
    const std::uint64_t refused_events =
        refused == status.refused_events.end() ? 0 : refused->second;
    RC_ASSERT(queue.received == queue.thinned + queue.dropped + queue.paused + queue.refused +
                                    queue.after_end + queue.taken);
    RC_ASSERT(queue.taken == counts.read + refused_events);
    RC_ASSERT(counts.read ==
              counts.used + counts.without_pose + counts.outside_window + counts.dropped);
    received += queue.received;
    kept += counts.used + counts.outside_window + queue.paused;
  }
  RC_ASSERT(std::abs(status.live->dropRatio() * static_cast<double>(received) -
                     static_cast<double>(received - kept)) < 0.5);
}

}  // namespace
}  // namespace efm
