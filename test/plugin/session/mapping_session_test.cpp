// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/session/mapping_session.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <map>
#include <set>
#include <string>

#include "mapping/geometry/timestamp.h"
#include "maps/metrics/depth_metrics.h"
#include "plugin/session/recording_survey.h"
#include "test/plugin/session/session_driver.h"
#include "test/plugin/temporary_folder.h"
#include "tracking_stub/truth/dataset_writer.h"

namespace efm {
namespace {

using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;

void expectEventsAddUp(const SessionStatus& status, std::uint64_t events) {
  const EventCounts total = status.counts.total();
  EXPECT_EQ(total.read, events);
  EXPECT_EQ(total.read, total.used + total.without_pose + total.outside_window + total.dropped +
                            total.filtered + total.outside_lens + total.over_budget);
}

void expectCountsAddUp(const SessionStatus& status, std::uint64_t events, int planes) {
  expectEventsAddUp(status, events);
  EXPECT_EQ(status.counts.votes.total(),
            status.counts.event_uses * static_cast<std::uint64_t>(planes));
}

TEST(MappingSession, MapsThePlaneThatTheDotsLieOn) {
  const SyntheticRecording recording;
  MappingSession session(syntheticOptions());

  const auto keyframes = mapAll(session, recording);

  EXPECT_EQ(keyframes.size(),
            3U);  // [0, .2), [.1, .3), [.2, .4); [.3, .5) ends after the last event
  std::vector<DepthPair> pairs;
  const MapCloud::ConstPtr points = session.cloud().points();
  for (const MapPoint& point : *points) {
    pairs.push_back({point.z, SyntheticRecording::kDepthM});
  }
  ASSERT_GT(pairs.size(), 30U);
  // A window sees 8 px of parallax of dots that are rounded to pixels: an error of half a pixel is
  // 0.5 / 8 of 1 / (2 m), a little over one step of the planes.
  const double step = (1.0 / 1.0 - 1.0 / 5.0) / 29;
  EXPECT_LT(depthErrors(pairs).median_inverse, 1.5 * step);
}

EventFusionOptions automaticOptions() {
  EventFusionOptions options = syntheticOptions();
  options.automatic = defaultOptions().automatic;
  return options;
}

RecordingSurvey surveyOf(const SyntheticRecording& recording, const EventFusionOptions& options) {
  RecordingSurveyor surveyor(options);
  for (const StampedPose& pose : recording.poses) surveyor.addPose(pose, {});
  for (double begin_s = 0; begin_s < 5; begin_s += 0.1) {
    for (const int c : {0, 1}) surveyor.addEvents(pieceOf(recording, c, begin_s, begin_s + 0.1));
  }
  return surveyor.finish();
}

TEST(MappingSession, InPlaybackOptionsAreChosenFromTheWholeRecording) {
  for (const double duration_s : {0.5, 4.2}) {
    const SyntheticRecording recording(duration_s);
    EventFusionOptions options = automaticOptions();
    const RecordingSurvey survey = surveyOf(recording, options);
    const OptionChoice choice = chooseOptions(options.automatic, survey.rig, survey.samples,
                                              survey.duration_s, options.mapper);
    EXPECT_TRUE(choice.found_scene);
    options.automatic = {};
    MappingSession expected(options);
    mapAll(expected, recording);
    MappingSession session(automaticOptions());

    EXPECT_THAT(mapUnfinished(session, recording, 10), IsEmpty()) << "more may come";
    EXPECT_THAT(mapRest(session), Not(IsEmpty()));

    expectSameMap(session, expected);
    const SessionStatus status = session.status();
    ASSERT_EQ(status.chosen.size(), 5U);
    for (std::size_t i = 0; i < 5; ++i) {
      EXPECT_EQ(status.chosen[i].key, choice.options[i].key);
      EXPECT_EQ(status.chosen[i].value, choice.options[i].value);
      EXPECT_EQ(status.chosen[i].reason, choice.options[i].reason);
    }
  }
}

TEST(MappingSession, InPlaybackAStreamSaysWhatItsOptionsWereChosenFrom) {
  const SyntheticRecording recording(3.2);
  for (const bool is_full : {true, false}) {
    EventFusionOptions options = automaticOptions();
    if (is_full) options.live.max_queue_mb = 0.1;  // some 6000 of 22,000 events
    MappingSession session(options);
    if (!is_full) session.endSurvey();
    EXPECT_THAT(mapUnfinished(session, recording, 10), Not(IsEmpty())) << is_full;
    const SessionStatus status = session.status();
    ASSERT_EQ(status.chosen.size(), 5U);
    EXPECT_THAT(status.chosen[0].reason, HasSubstr(" s of a stream")) << is_full;
    EXPECT_EQ(status.chosen[0].reason.find("max_queue_mb") != std::string::npos, is_full);
  }
}

TEST(MappingSession, TheFirstLookAtARecordingIsNoLiveOperation) {
  SyntheticRecording recording(4.2);
  for (StampedPose& pose : recording.poses) {  // a jump after 0.7 s
    const bool is_later = pose.t_ns > SyntheticRecording::kStartNs + 700'000'000;
    pose.T_world_rig.translation.y() += is_later ? 10 : 0;
  }
  EventFusionOptions options = automaticOptions();
  options.live.enabled = true;
  const RecordingSurvey survey = surveyOf(recording, options);
  EXPECT_EQ(survey.samples.size(), 2U);  // of 2 s each
  EXPECT_NEAR(survey.duration_s.value_or(0), 4.2, 0.02);
}

/// The distance of a map's points from the plane of the dots, in steps of 30 planes from 1 to 5 m.
double medianErrorInSteps(const MappingSession& session) {
  std::vector<DepthPair> pairs;
  const MapCloud::ConstPtr points = session.cloud().points();
  for (const MapPoint& point : *points) {
    pairs.push_back({positionIn(*points, point).z(), SyntheticRecording::kDepthM});
  }
  if (pairs.empty()) return std::numeric_limits<double>::infinity();
  return depthErrors(pairs).median_inverse / ((1.0 / 1.0 - 1.0 / 5.0) / 29);
}

TEST(MappingSession, JumpsBeforeTheChoiceOfOptionsLoseNoStretch) {
  struct Row {
    double duration_s;
    std::vector<double> jumps_s;
    std::set<std::ptrdiff_t> mapped;  // stretches, from 1
    bool before_the_end;
  };
  const Row rows[] = {
      {2.4, {0.3, 0.6}, {3}, true},             // the choice waits for the third stretch
      {3.2, {0.3, 1.2, 2.0}, {2, 3, 4}, true},  // chosen in the second one, which lasts 0.9 s
      {0.9, {0.2}, {2}, false},                 // what the end leaves is chosen from
  };
  for (const Row& row : rows) {
    SyntheticRecording recording(row.duration_s);
    std::vector<std::int64_t> begins_ns{SyntheticRecording::kStartNs};
    for (const double jump_s : row.jumps_s) {
      begins_ns.push_back(SyntheticRecording::kStartNs + durationFromSeconds(jump_s));
    }
    const auto stretchOf = [&](std::int64_t t_ns) {
      return std::upper_bound(begins_ns.begin(), begins_ns.end(), t_ns) - begins_ns.begin();
    };
    for (StampedPose& pose : recording.poses) {
      pose.T_world_rig.translation.y() += 10.0 * static_cast<double>(stretchOf(pose.t_ns));
    }
    EventFusionOptions options = automaticOptions();
    options.live.enabled = true;
    MappingSession session(options);

    std::vector<KeyframeDepthMap> keyframes = mapUnfinished(session, recording, 10);
    EXPECT_EQ(!keyframes.empty(), row.before_the_end) << row.jumps_s[0];
    for (KeyframeDepthMap& keyframe : mapRest(session)) keyframes.push_back(std::move(keyframe));

    const std::string what = testing::PrintToString(row.jumps_s);
    EXPECT_EQ(session.status().live->pose_jumps, row.jumps_s.size()) << what;
    std::set<std::ptrdiff_t> mapped;
    for (const KeyframeDepthMap& keyframe : keyframes) {
      EXPECT_EQ(stretchOf(keyframe.window.t0_ns), stretchOf(keyframe.window.t1_ns - 1)) << what;
      mapped.insert(stretchOf(keyframe.window.t0_ns));
    }
    EXPECT_EQ(mapped, row.mapped) << what;
    EXPECT_LT(medianErrorInSteps(session), 1.5) << what;
    for (const ChosenOption& option : session.status().chosen) {
      EXPECT_THAT(option.reason, Not(HasSubstr("default"))) << what;
    }
    expectEventsAddUp(session.status(), recording.totalEvents());
  }
}

TEST(MappingSession, TheChoiceOfOptionsWaitsForAScene) {
  constexpr double kDepthM = 20;
  constexpr double kSpeedMS = 2;
  for (const double rest_s : {1.3, 10.7}) {  // shorter and longer than the choice waits
    const SyntheticRecording recording(rest_s + 4.3, 1, {kDepthM, kSpeedMS, rest_s, 1});
    EventFusionOptions options = automaticOptions();
    options.live.enabled = true;
    MappingSession session(options);

    const std::vector<KeyframeDepthMap> keyframes = mapUnfinished(session, recording, 50);

    ASSERT_FALSE(keyframes.empty()) << rest_s;
    const DepthPlanesOptions& planes = session.planes();
    const double pixel = 1 / (recording.cameras[0].model.fx * kSpeedMS);  // in a window of 1 s
    const double step = std::max(
        pixel, (1 / planes.min_depth_m - 1 / planes.max_depth_m) / (planes.num_planes - 1));
    std::vector<DepthPair> pairs;
    for (const float depth_m : keyframes.back().map.depth) {
      if (depth_m > 0) pairs.push_back({depth_m, kDepthM});
    }
    ASSERT_GT(pairs.size(), 100U) << rest_s;
    EXPECT_LT(depthErrors(pairs).median_inverse, step) << rest_s;
    EXPECT_LT(planes.min_depth_m, kDepthM) << rest_s;
    EXPECT_GT(planes.max_depth_m, kDepthM) << rest_s;
    const SessionStatus status = session.status();
    EXPECT_EQ(status.choices, rest_s < 10 ? 1U : 2U) << "the first time without a scene";
    EXPECT_FALSE(status.scene_unknown) << rest_s;
    EXPECT_THAT(status.chosen.at(0).reason, HasSubstr("; from 1 s at ")) << rest_s;
  }
}

TEST(MappingSession, CountsOfOverlappingWindowsAddUp) {
  const SyntheticRecording recording;
  MappingSession session(syntheticOptions());

  mapAll(session, recording);

  const SessionStatus status = session.status();
  expectCountsAddUp(status, recording.totalEvents(), 30);
  EXPECT_GT(status.counts.event_uses, status.counts.total().used) << "windows overlap";
  EXPECT_GT(status.counts.total().outside_window, 0U) << "the last window is not full";
}

TEST(MappingSession, InPlaybackTheLastWindowIsMovedBackToEndWithTheRecording) {
  const SyntheticRecording recording;
  for (const bool live : {false, true}) {
    EventFusionOptions options = syntheticOptions();
    options.mapper.fill_last_window = true;
    options.live.enabled = live;
    MappingSession session(options);
    const auto keyframes = mapAll(session, recording);
    ASSERT_EQ(keyframes.size(), live ? 3U : 4U);
    EXPECT_EQ(session.status().counts.total().outside_window > 100, live);
    if (live) continue;
    const Window& last = keyframes.back().window;
    EXPECT_EQ(last.t1_ns - last.t0_ns, 200'000'000);
    std::int64_t newest_ns = 0;  // of the events before the last pose
    for (const std::vector<Event>& events : recording.events) {
      for (const Event& event : events) {
        if (event.t_ns < recording.poses.back().t_ns) newest_ns = std::max(newest_ns, event.t_ns);
      }
    }
    EXPECT_EQ(last.t1_ns, newest_ns + 1);
    expectCountsAddUp(session.status(), recording.totalEvents(), 30);
  }
}

TEST(MappingSession, EventsOutsideTheTimeLimitsAreInNoWindow) {
  const SyntheticRecording recording;
  const std::int64_t start_ns = SyntheticRecording::kStartNs;
  EventFusionOptions options = syntheticOptions();
  options.mapper.limits = {start_ns + 100'000'000, start_ns + 350'000'000};
  MappingSession session(options);

  const auto keyframes = mapAll(session, recording);

  ASSERT_EQ(keyframes.size(), 1U);  // [.1, .3); [.2, .4) reaches beyond the limit
  EXPECT_GE(keyframes[0].window.t0_ns, start_ns + 100'000'000);
  expectCountsAddUp(session.status(), recording.totalEvents(), 30);
}

TEST(MappingSession, OfPosesOfTheSameTimeTheFirstCounts) {
  const SyntheticRecording recording;
  MappingSession expected(syntheticOptions());
  mapAll(expected, recording);
  MappingSession session(syntheticOptions());
  for (StampedPose pose : recording.poses) {
    session.addPose(pose);
    pose.T_world_rig.translation.z() += 1;
    session.addPose(pose);
  }
  addEvents(session, recording);
  mapRest(session);
  EXPECT_EQ(session.status().counts.duplicate_poses, recording.poses.size());
  expectSameMap(session, expected);
}

TEST(MappingSession, CamerasThatSeeNothingAreCounted) {
  SyntheticRecording recording;
  recording.events[1].clear();
  MappingSession session(syntheticOptions());

  const auto keyframes = mapAll(session, recording);

  EXPECT_THAT(session.status().silent_keyframes, testing::ElementsAre(0, keyframes.size()));
}

TEST(MappingSession, AnOptionWithAMissingCameraIsAnError) {
  const SyntheticRecording recording;
  EventFusionOptions cameras = syntheticOptions();
  cameras.mapper.cameras = {1, 7};
  MappingSession selected(cameras);
  EXPECT_EQ(messageOf([&] { mapAll(selected, recording); }),
            "[rig] cameras = 7: must be a camera of the recording: 0 to 1");
  EventFusionOptions reference = syntheticOptions();
  reference.mapper.keyframe.reference_camera = 5;
  MappingSession referred(reference);
  EXPECT_EQ(messageOf([&] { mapAll(referred, recording); }),
            "[dsi] reference_camera = 5: must be a camera of the recording: 0 to 1");
}

TEST(MappingSession, ACameraWithoutTheOneBeforeItIsAnError) {
  MappingSession session(syntheticOptions());
  session.addEvents(packetOf(SyntheticRecording(), 1));
  EXPECT_EQ(messageOf([&] { session.finish(); }),
            "the recording has events of camera 1 but none of camera 0");
  EXPECT_FALSE(session.next());
}

TEST(MappingSession, ACameraWaitsForAMissingOneForASecond) {
  const SyntheticRecording recording(1.5, 3);
  for (const bool zero_is_there : {false, true}) {
    MappingSession session(syntheticOptions());
    std::size_t refused = 0;
    for (int i = 0; i < 150; ++i) {
      if (zero_is_there) session.addEvents(pieceOf(recording, 0, 0.01 * i, 0.01 * (i + 1)));
      CameraPacket packet = pieceOf(recording, 2, 0.01 * i, 0.01 * (i + 1));
      if (packet.events.empty()) continue;
      const std::string refusal = messageOf([&] { session.addEvents(packet); });
      if (refusal == "no error") continue;
      EXPECT_GE(i, 100);
      ++refused;
      EXPECT_THAT(refusal,
                  HasSubstr(zero_is_there ? "has events of camera 2 but none of camera 1"
                                          : "has events of camera 2 but none of camera 0"));
    }
    EXPECT_GT(refused, 40U);
    EXPECT_THROW(session.finish(), std::invalid_argument);
  }
}

TEST(MappingSession, CamerasInAnyOrderMakeTheSameMap) {
  const SyntheticRecording recording(0.5, 3);
  MappingSession expected(syntheticOptions());
  mapAll(expected, recording);

  MappingSession session(syntheticOptions());
  for (const StampedPose& pose : recording.poses) session.addPose(pose);
  for (int i = 0; i < 50; ++i) {
    for (const int camera : {2, 1}) {
      session.addEvents(pieceOf(recording, camera, 0.01 * i, 0.01 * (i + 1)));
    }
  }
  EXPECT_FALSE(session.status().events);
  session.addEvents(packetOf(recording, 0));
  EXPECT_EQ(session.status().counts.cameras.size(), 3U);
  mapRest(session);
  expectSameMap(session, expected);
}

TEST(MappingSession, ARefusedPacketTakesNoOtherWithIt) {
  const SyntheticRecording recording;
  MappingSession session(syntheticOptions());
  CameraPacket outside = pieceOf(recording, 1, 0, 0.1);
  outside.events.back().x = 120;
  session.addEvents(outside);
  session.addEvents(pieceOf(recording, 1, 0.1, 0.5));
  EXPECT_THAT(messageOf([&] { session.addEvents(packetOf(recording, 0)); }),
              HasSubstr("pixel (120"));
  EXPECT_EQ(session.status().counts.cameras.at(0).read, recording.events[0].size());
  EXPECT_EQ(session.status().counts.cameras.at(1).read,
            pieceOf(recording, 1, 0.1, 0.5).events.size());
  EXPECT_NO_THROW(session.finish());
}

TEST(MappingSession, ACameraThatAppearsAfterTheFirstSecondIsAnError) {
  const SyntheticRecording recording(1.2);
  MappingSession session(syntheticOptions());
  session.addEvents(pieceOf(recording, 0, 0, 0.6));
  session.addEvents(pieceOf(recording, 0, 0.6, 1.1));
  session.addEvents(pieceOf(recording, 0, 1.1, 1.2));
  EXPECT_THROW(session.addEvents(packetOf(recording, 1)), std::invalid_argument);
}

TEST(MappingSession, ARecordingThatAnnouncesItsCamerasIsMappedWithoutAWait) {
  const SyntheticRecording recording;
  MappingSession expected(syntheticOptions());
  mapPiecewise(expected, recording, 10);
  enum class Start { kAnnounced, kInexact, kNoPoses, kTimeOffsets };
  for (const auto& [start, early_keyframes] :
       {std::pair{Start::kAnnounced, 3U}, std::pair{Start::kInexact, 0U},
        std::pair{Start::kNoPoses, 0U}, std::pair{Start::kTimeOffsets, 3U}}) {
    EventFusionOptions options = syntheticOptions();
    if (start == Start::kTimeOffsets) options.rig.time_offsets_ns = {0, 0};
    MappingSession session(options);
    if (start != Start::kNoPoses) addPoses(session, recording);
    for (const int c : {0, 1}) {
      const auto index = static_cast<std::size_t>(c);
      CameraPacket empty{c, recording.cameras[index], {}, recording.events[index].front().t_ns};
      const bool exact = start == Start::kAnnounced || start == Start::kNoPoses;
      if (!exact) --*empty.covered_until_ns;
      session.addEvents(empty);
    }
    std::size_t early = 0;
    for (int i = 0; i < 50; ++i) {
      for (const int c : {0, 1}) {
        session.addEvents(pieceOf(recording, c, 0.01 * i, 0.01 * (i + 1)));
      }
      early += mapDue(session).size();
    }
    EXPECT_EQ(early, early_keyframes) << static_cast<int>(start);
    if (start == Start::kNoPoses) addPoses(session, recording);
    mapRest(session);
    expectSameMap(session, expected);
  }
}

TEST(MappingSession, PacketsMayBeLongerThanASecond) {
  const SyntheticRecording recording(1.5);
  MappingSession expected(syntheticOptions());
  mapPiecewise(expected, recording, 100);
  MappingSession session(syntheticOptions());
  mapAll(session, recording);
  expectSameMap(session, expected);
}

TEST(MappingSession, ACalibrationThatChangesIsAnError) {
  const SyntheticRecording recording;
  MappingSession session(syntheticOptions());
  session.addEvents(packetOf(recording, 0));
  CameraPacket other{0, recording.cameras[0], {}, std::nullopt};
  other.calibration.model.fx += 1;
  EXPECT_THROW(session.addEvents(other), std::invalid_argument);
}

TEST(MappingSession, ARefusedPacketLeavesTheCountsAsTheyWere) {
  const SyntheticRecording recording;
  EventFusionOptions options = syntheticOptions();
  options.mapper.limits.t0_ns = SyntheticRecording::kStartNs;
  MappingSession session(options);
  CameraPacket packet = packetOf(recording, 0);
  packet.events.front().t_ns = 0;  // outside the limits
  packet.events.back().x = 120;    // outside the sensor
  EXPECT_THROW(session.addEvents(packet), std::invalid_argument);
  EXPECT_EQ(session.status().counts.total().read, 0U);
  EXPECT_FALSE(session.status().events);
}

// --- Windows that are given up -------------------------------------------------------------------

/// Options of live operation with windows of about 0.2 s that do not overlap.
EventFusionOptions liveOptions(KeyframePolicyKind policy) {
  EventFusionOptions options = syntheticOptions();
  options.live.enabled = true;
  options.mapper.policy.policy = policy;
  options.mapper.policy.window_events = 400;
  options.mapper.policy.min_baseline_ratio = 0.05;
  options.mapper.policy.stride_s = policy == KeyframePolicyKind::kBaseline ? 0.05 : 0.2;
  return options;
}

/// Feeds two seconds and does not end them: windows stay to come.
void feedTwoSeconds(MappingSession& session, const SyntheticRecording& recording) {
  addPoses(session, recording);
  for (const double begin_s : {0.0, 1.1}) {  // the second packets make the rig complete
    for (const int c : {0, 1}) session.addEvents(pieceOf(recording, c, begin_s, begin_s + 1.1));
  }
}

/// The starts of the windows, if none of them is mapped.
std::vector<std::int64_t> startsOfWindows(MappingSession& session) {
  std::vector<std::int64_t> starts;
  while (const auto data = session.window()) {
    starts.push_back(data->window.t0_ns);
    session.skipWindow(data->window);
  }
  return starts;
}

TEST(MappingSession, AWindowIsGivenUpAsAWholeAndCountedOnceWithEveryPolicy) {
  const SyntheticRecording recording(2);
  for (const auto& [policy, at_least] :
       {std::pair{KeyframePolicyKind::kPeriod, 8U}, std::pair{KeyframePolicyKind::kEvents, 15U},
        std::pair{KeyframePolicyKind::kBaseline, 6U}}) {
    MappingSession skipping(liveOptions(policy));
    feedTwoSeconds(skipping, recording);
    const std::vector<std::int64_t> expected = startsOfWindows(skipping);
    ASSERT_GE(expected.size(), at_least);
    for (const bool for_overload : {false, true}) {  // or for an error
      MappingSession session(liveOptions(policy));
      feedTwoSeconds(session, recording);
      std::vector<std::int64_t> starts;
      std::size_t given_up = 0;
      while (const std::optional<Window> window = session.nextWindow()) {
        starts.push_back(window->t0_ns);
        if (!for_overload) {
          AlwaysFailingSink sink;
          EXPECT_THROW(session.next(&sink, processSeconds), std::runtime_error);
          ASSERT_TRUE(session.giveUpFailed());
        } else if (!session.giveUpOldestWindow()) {
          break;  // no newer events fill another one
        }
        ++given_up;
      }
      EXPECT_EQ(starts, expected) << nameOf(policy);
      EXPECT_GE(given_up, expected.size() - 1) << nameOf(policy);
      EXPECT_EQ(session.status().counts.windows_given_up.total(), given_up) << nameOf(policy);
    }
  }
}

// --- The options' calibration ------------------------------------------------------------------

class CalibratedSession : public TemporaryFolder {
 protected:
  /// Options with a calibration of other cameras.
  EventFusionOptions optionsOf(const std::vector<RigCamera>& cameras) const {
    EventFusionOptions options = syntheticOptions();
    options.rig.calibration = folder() / "camchain.yaml";
    std::ofstream(options.rig.calibration) << formatCamchain({cameras});
    return options;
  }
};

TEST_F(CalibratedSession, UsesTheOptionsCalibrationAndCountsDifferentCameras) {
  const SyntheticRecording recording;
  std::vector<RigCamera> cameras = recording.cameras;
  MappingSession same(optionsOf(cameras));
  mapAll(same, recording);
  EXPECT_EQ(same.status().recalibrated_cameras, 0U);

  cameras[1].T_rig_cam.translation.y() += 1e-3;
  MappingSession moved(optionsOf(cameras));
  mapAll(moved, recording);
  EXPECT_EQ(moved.status().recalibrated_cameras, 1U);
  EXPECT_NEAR(moved.status().rig.cameras[1].T_rig_cam.translation.y(), 1e-3, 1e-12);
  cameras[0].model.cx += 1;
  MappingSession both(optionsOf(cameras));
  mapAll(both, recording);
  EXPECT_EQ(both.status().recalibrated_cameras, 2U);
  EXPECT_EQ(both.status().rig.cameras[0].model.cx, recording.cameras[0].model.cx + 1);
}

TEST_F(CalibratedSession, AnotherNumberOfCamerasIsAnError) {
  const SyntheticRecording recording;
  std::vector<RigCamera> cameras = recording.cameras;
  cameras.push_back(cameras[1]);
  MappingSession more(optionsOf(cameras));
  EXPECT_THAT(messageOf([&] { mapAll(more, recording); }), HasSubstr("3 cameras: expected 2"));
  cameras.resize(1);
  MappingSession fewer(optionsOf(cameras));
  EXPECT_THAT(messageOf([&] { mapAll(fewer, recording); }), HasSubstr("1 camera, but"));
}

}  // namespace
}  // namespace efm
