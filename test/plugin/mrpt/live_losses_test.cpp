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

}  // namespace
}  // namespace efm
