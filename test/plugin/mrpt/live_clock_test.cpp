// SPDX-License-Identifier: BSD-3-Clause
// Live operation where the clocks of sensors are wrong.
#include <gtest/gtest.h>

#include <chrono>
#include <set>
#include <string>

#include "test/plugin/mrpt/live_driver.h"

namespace efm {
namespace {

using mrpt::obs::CObservation;

/// Moves the times of all packets or of one camera's that begin in [from, to).
Observations withClockOf(int camera, std::int64_t from_ns, std::int64_t to_ns, std::int64_t move_ns,
                         const Observations& observations) {
  return changed(observations, [&](CObservation& observation) {
    CObservationEvents* packet = packetIn(observation);
    const std::int64_t t_ns = nanosecondsFrom(observation.timestamp);
    if (packet == nullptr || packet->camera_index != camera || t_ns < from_ns || t_ns >= to_ns) {
      return;
    }
    packet->covered_until_ns.reset();
    for (Event& event : packet->events) event.t_ns += move_ns;
  });
}

TEST(LiveClock, LateEventsOfOneCameraAreDroppedAndNothingElse) {
  const SyntheticRecording recording(2.4);
  const Observations healthy = observationsOf(recording);
  CEventFusionMapBuilder expected(liveOptions());
  playPatiently(expected, healthy);
  ASSERT_EQ(expected.trajectory().size(), 22U);

  struct Case {
    const char* name;
    std::vector<std::int64_t> late_ns;  // in the middle of each packet: before its last event
    bool own_packet;
  };
  const Case cases[] = {{"one of each packet", {20 * kMs}, false},
                        {"more than the limit by a nanosecond", {10 * kMs + 1}, false},
                        {"a packet of its own", {20 * kMs}, true},
                        {"old packets that are not in order", {1500 * kMs, 1520 * kMs}, true}};
  for (const Case& test : cases) {
    for (const double rate : {0.0, 1e6}) {
      SCOPED_TRACE(test.name + std::string(", budget ") + std::to_string(rate));
      Observations observations;
      std::uint64_t added = 0;
      for (const auto& observation : changed(healthy, [](CObservation&) {})) {
        observations.push_back(observation);
        CObservationEvents* packet = packetIn(*observation);
        if (packet == nullptr || packet->camera_index != 1 || packet->events.empty()) continue;
        auto late = packetObservation(recording, 1);
        late->timestamp = packet->timestamp;
        const std::int64_t newest_ns = packet->events.back().t_ns;
        for (const std::int64_t late_ns : test.late_ns) {
          late->events.push_back({newest_ns - late_ns, 60, 45, true});
        }
        added += late->events.size();
        if (test.own_packet) {
          observations.push_back(late);
        } else {
          packet->events.insert(packet->events.end(), late->events.begin(), late->events.end());
        }
      }
      EventFusionOptions options = liveOptions();
      options.live.max_event_rate = rate;
      CEventFusionMapBuilder builder(options);
      builder.setVerbosityLevel(mrpt::system::LVL_ERROR);
      playPatiently(builder, observations);

      const SessionStatus status = builder.status();
      EXPECT_EQ(status.live->clock_steps, 0U);
      EXPECT_EQ(builder.trajectory().size(), 22U);
      expectSameBits(builder.points(), expected.points());
      const auto refused = status.refused_events.find(1);
      EXPECT_EQ(status.counts.late_events +
                    (refused == status.refused_events.end() ? 0 : refused->second),
                added);
      EXPECT_EQ(status.counts.cameras.at(0).dropped, 0U);
      expectSumsAgree(status);
    }
  }
}

TEST(LiveClock, EachClockResetStartsTheMappingAnewOnce) {
  const SyntheticRecording recording(2.5);
  const Observations observations = observationsOf(recording);
  CEventFusionMapBuilder builder(liveOptions());
  builder.setVerbosityLevel(mrpt::system::LVL_ERROR);
  feedPatiently(builder, observations);
  feedPatiently(builder, observations);  // the same times again
  playPatiently(builder, observations);

  const SessionStatus status = builder.status();
  EXPECT_EQ(status.live->clock_steps, 2U);
  expectSumsAgree(status);
  // Windows of 0.2 s, every 0.1 s: 23, and from 1 s on 12 or 13 after a reset.
  EXPECT_GE(builder.trajectory().size(), 23U + 12U + 12U);
  EXPECT_LE(builder.trajectory().size(), 23U + 14U + 14U);
}

TEST(LiveClock, AClockThatGoesBackAloneStopsItsCameraAlone) {
  const SyntheticRecording recording(3.5);
  const std::int64_t start_ns = SyntheticRecording::kStartNs;
  const std::int64_t back_ns = start_ns + 1000 * kMs;
  const std::int64_t again_ns = start_ns + 2700 * kMs;
  const Observations observations =
      withClockOf(1, back_ns, again_ns, -5000 * kMs, observationsOf(recording));
  CEventFusionMapBuilder builder(liveOptions());
  builder.setVerbosityLevel(mrpt::system::LVL_ERROR);
  playPatiently(builder, observations);

  const SessionStatus status = builder.status();
  EXPECT_EQ(status.live->clock_steps, 0U);
  EXPECT_EQ(builder.trajectory().size(), 33U) << "all of camera 0";
  std::uint64_t moved = 0;
  for (const auto& observation : observations) {
    CObservationEvents* packet = packetIn(*observation);
    const bool is_moved = packet != nullptr && packet->camera_index == 1 &&
                          !packet->events.empty() && packet->events[0].t_ns < start_ns;
    if (is_moved) moved += packet->events.size();
  }
  EXPECT_EQ(status.refused_events.at(1) + status.counts.late_events, moved);
  EXPECT_GE(status.silent_keyframes.at(1), 14U) << "windows of 0.2 s, every 0.1 s, in 1.7 s";
  EXPECT_LE(status.silent_keyframes.at(1), 16U) << "its clock is right again";
  EXPECT_EQ(status.silent_keyframes.at(0), 0U);
  expectSumsAgree(status);
}

TEST(LiveClock, EventsAloneThatGoBackInShortPacketsStartTheMappingAnew) {
  const SyntheticRecording recording(3);
  CEventFusionMapBuilder builder(liveOptions());
  builder.setVerbosityLevel(mrpt::system::LVL_ERROR);
  std::vector<std::size_t> begin(2, 0);
  Observations observations;
  for (std::int64_t t_ns = SyntheticRecording::kStartNs; t_ns < recording.poses.back().t_ns;
       t_ns += 1'000'000) {  // the budget holds events until the end of their 10 ms
    for (std::size_t c = 0; c < 2; ++c) {
      auto packet = packetObservation(recording, static_cast<int>(c));
      packet->timestamp = mrptTimeFrom(t_ns);
      const std::vector<Event>& events = recording.events[c];
      for (; begin[c] < events.size() && events[begin[c]].t_ns < t_ns + 1'000'000; ++begin[c]) {
        packet->events.push_back(events[begin[c]]);
      }
      observations.push_back(packet);
    }
  }
  // After half a second one event of camera 0 lies an hour ahead.
  auto ahead = packetObservation(recording, 0);
  ahead->events = {{SyntheticRecording::kStartNs + 3'600'000'000'000, 1, 1, true}};
  observations.insert(observations.begin() + 1000, ahead);
  std::size_t pose = 0;
  for (const auto& observation : observations) {
    const std::int64_t t_ns = nanosecondsFrom(observation->timestamp);
    for (; observation != ahead && pose < recording.poses.size() &&
           recording.poses[pose].t_ns <= t_ns + 10'000'000;
         ++pose) {
      auto robot = mrpt::obs::CObservationRobotPose::Create();
      robot->timestamp = mrptTimeFrom(recording.poses[pose].t_ns);
      robot->sensorLabel = "pose";
      robot->pose.mean = mrptPoseFrom(recording.poses[pose].T_world_rig);
      builder.processObservation(robot);
    }
    feedPatiently(builder, {observation});
  }
  builder.finish();
  const SessionStatus status = builder.status();
  EXPECT_EQ(status.live->clock_steps, 1U);
  expectSumsAgree(status);
  EXPECT_GE(builder.trajectory().size(), 10U) << "of 28";
}

TEST(LiveClock, OnePoseFromTheFutureCostsASecond) {
  const SyntheticRecording recording(3);
  Observations observations = observationsOf(recording);
  const auto future = changed({observations[2]},
                              [](CObservation& pose) { pose.timestamp += std::chrono::hours(1); });
  ASSERT_EQ(future[0]->sensorLabel, "pose");
  observations.insert(observations.begin() + 100, future[0]);  // of 900
  CEventFusionMapBuilder builder(liveOptions());
  builder.setVerbosityLevel(mrpt::system::LVL_ERROR);
  playPatiently(builder, observations);

  const SessionStatus status = builder.status();
  EXPECT_EQ(status.live->clock_steps, 1U);
  expectSumsAgree(status);
  CEventFusionMapBuilder playback(syntheticOptions());
  play(playback, observationsOf(recording));
  const std::set<std::int64_t> all = keyframeTimes(playback);
  const std::set<std::int64_t> times = keyframeTimes(builder);
  EXPECT_GE(times.size(), all.size() - 14) << "windows of 0.2 s, every 0.1 s";
  EXPECT_LT(times.size(), all.size());
  EXPECT_NEAR(builder.getCurrentPoseEstimation()->getMeanVal().x(),
              recording.poses.back().T_world_rig.translation.x(), 1e-9);
}

}  // namespace
}  // namespace efm
