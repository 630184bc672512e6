// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/session/mapping_session.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "maps/metrics/depth_metrics.h"
#include "plugin/session/no_keyframe.h"
#include "test/plugin/session/synthetic_recording.h"

namespace efm {
namespace {

using testing::AllOf;
using testing::HasSubstr;

CameraPacket packetOf(const SyntheticRecording& recording, int camera) {
  const auto index = static_cast<std::size_t>(camera);
  return {camera, recording.cameras[index], recording.events[index], std::nullopt};
}

std::vector<KeyframeDepthMap> mapDue(MappingSession& session) {
  std::vector<KeyframeDepthMap> keyframes;
  while (auto keyframe = session.next()) keyframes.push_back(std::move(*keyframe));
  return keyframes;
}

/// Everything at once: poses, then each camera's events in one packet.
std::vector<KeyframeDepthMap> mapAll(MappingSession& session, const SyntheticRecording& recording) {
  for (const StampedPose& pose : recording.poses) session.addPose(pose);
  for (int c = 0; c < static_cast<int>(recording.cameras.size()); ++c) {
    session.addEvents(packetOf(recording, c));
  }
  session.finish();
  return mapDue(session);
}

void expectCountsAddUp(const SessionStatus& status, std::uint64_t events, int planes) {
  const EventCounts total = status.counts.total();
  EXPECT_EQ(total.read, events);
  EXPECT_EQ(total.read, total.used + total.without_pose + total.outside_window + total.dropped +
                            total.filtered);
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
  for (const CloudPoint& point : session.cloud().points()) {
    pairs.push_back({point.p_world.z(), SyntheticRecording::kDepthM});
  }
  ASSERT_GT(pairs.size(), 30U);
  // A window sees 8 px of parallax of dots that are rounded to pixels: an error of half a pixel is
  // 0.5 / 8 of 1 / (2 m), a little over one step of the planes.
  const double step = (1.0 / 1.0 - 1.0 / 5.0) / 29;
  EXPECT_LT(depthErrors(pairs).median_inverse, 1.5 * step);
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

TEST(MappingSession, TheMapDoesNotDependOnHowTheRecordingWasCut) {
  const SyntheticRecording recording;
  MappingSession at_once(syntheticOptions());
  mapAll(at_once, recording);

  MappingSession piecewise(syntheticOptions());
  std::size_t keyframes = 0;
  std::vector<std::size_t> begin(recording.cameras.size(), 0);
  for (const StampedPose& pose : recording.poses) {
    for (std::size_t c = recording.cameras.size(); c-- > 0;) {  // camera 1 comes first
      const std::vector<Event>& events = recording.events[c];
      CameraPacket packet{static_cast<int>(c), recording.cameras[c], {}, pose.t_ns};
      for (; begin[c] < events.size() && events[begin[c]].t_ns < pose.t_ns; ++begin[c]) {
        packet.events.push_back(events[begin[c]]);
      }
      piecewise.addEvents(packet);
    }
    piecewise.addPose(pose);
    keyframes += mapDue(piecewise).size();
  }
  piecewise.finish();
  keyframes += mapDue(piecewise).size();

  EXPECT_EQ(keyframes, at_once.cloud().keyframes());
  const auto expected = at_once.cloud().points();
  const auto points = piecewise.cloud().points();
  ASSERT_EQ(points.size(), expected.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    EXPECT_EQ(points[i].p_world, expected[i].p_world);
  }
}

TEST(MappingSession, EventsOutsideTheTimeLimitsCountAsOutsideAnyWindow) {
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

TEST(MappingSession, CamerasThatSeeNothingAreCounted) {
  SyntheticRecording recording;
  recording.events[1].clear();
  MappingSession session(syntheticOptions());

  const auto keyframes = mapAll(session, recording);

  EXPECT_THAT(session.status().silent_keyframes, testing::ElementsAre(0, keyframes.size()));
}

TEST(MappingSession, OptionsThatNameACameraWhichIsNotThereAreErrors) {
  const SyntheticRecording recording;
  const auto refusal = [&](auto change) -> std::string {
    EventFusionOptions options = syntheticOptions();
    change(options.mapper);
    MappingSession session(options);
    try {
      mapAll(session, recording);
    } catch (const std::invalid_argument& error) {
      return error.what();
    }
    return "no error";
  };
  EXPECT_EQ(refusal([](FusionMapperOptions& mapper) {
              mapper.cameras = {1, 7};
            }),
            "[rig] cameras = 7: must be a camera of the recording: 0 to 1");
  EXPECT_EQ(refusal([](FusionMapperOptions& mapper) { mapper.keyframe.reference_camera = 5; }),
            "[dsi] reference_camera = 5: must be a camera of the recording: 0 to 1");
}

TEST(MappingSession, ACameraWithoutThoseBeforeItIsAnError) {
  const SyntheticRecording recording;
  MappingSession session(syntheticOptions());
  session.addEvents(packetOf(recording, 1));
  try {
    session.finish();
    FAIL() << "no error";
  } catch (const std::invalid_argument& error) {
    EXPECT_STREQ(error.what(), "the recording has events of camera 1 but none of camera 0");
  }
  EXPECT_FALSE(session.next());
}

/// What adding a packet is refused with.
std::string refusalOf(MappingSession& session, CameraPacket packet) {
  try {
    session.addEvents(std::move(packet));
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return "no error";
}

/// The events of one camera in [begin, end), seconds since the recording's start.
CameraPacket pieceOf(const SyntheticRecording& recording, int camera, double begin_s,
                     double end_s) {
  CameraPacket packet = packetOf(recording, camera);
  auto& events = packet.events;
  const auto outside = [&](const Event& event) {
    const double t_s = 1e-9 * static_cast<double>(event.t_ns - SyntheticRecording::kStartNs);
    return t_s < begin_s || t_s >= end_s;
  };
  events.erase(std::remove_if(events.begin(), events.end(), outside), events.end());
  return packet;
}

TEST(MappingSession, ACameraThatWaitsForOneThatNeverComesIsAnErrorAfterASecond) {
  const SyntheticRecording recording(1.5, 3);
  for (const bool zero_is_there : {false, true}) {
    MappingSession session(syntheticOptions());
    std::size_t refused = 0;
    for (int i = 0; i < 150; ++i) {
      if (zero_is_there) session.addEvents(pieceOf(recording, 0, 0.01 * i, 0.01 * (i + 1)));
      CameraPacket packet = pieceOf(recording, 2, 0.01 * i, 0.01 * (i + 1));
      if (packet.events.empty()) continue;
      const std::string refusal = refusalOf(session, std::move(packet));
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

TEST(MappingSession, CamerasThatComeInAnyOrderMakeTheSameMap) {
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
  session.finish();
  mapDue(session);

  const auto points = session.cloud().points();
  ASSERT_EQ(points.size(), expected.cloud().points().size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    EXPECT_EQ(points[i].p_world, expected.cloud().points()[i].p_world);
  }
}

TEST(MappingSession, APacketThatWaitedAndIsRefusedTakesNoOtherWithIt) {
  const SyntheticRecording recording;
  MappingSession session(syntheticOptions());
  CameraPacket outside = pieceOf(recording, 1, 0, 0.1);
  outside.events.back().x = 120;
  session.addEvents(outside);
  session.addEvents(pieceOf(recording, 1, 0.1, 0.5));
  EXPECT_THAT(refusalOf(session, packetOf(recording, 0)), HasSubstr("pixel (120"));
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

TEST(MappingSession, PacketsMayBeLongerThanASecond) {
  const SyntheticRecording recording(1.5);
  MappingSession expected(syntheticOptions());
  for (const StampedPose& pose : recording.poses) expected.addPose(pose);
  for (int i = 0; i < 15; ++i) {
    for (const int camera : {0, 1}) {
      expected.addEvents(pieceOf(recording, camera, 0.1 * i, 0.1 * (i + 1)));
    }
  }
  expected.finish();
  mapDue(expected);

  MappingSession session(syntheticOptions());
  mapAll(session, recording);

  EXPECT_EQ(session.cloud().keyframes(), expected.cloud().keyframes());
  const auto points = session.cloud().points();
  ASSERT_EQ(points.size(), expected.cloud().points().size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    EXPECT_EQ(points[i].p_world, expected.cloud().points()[i].p_world);
  }
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

// --- Why there is no keyframe ----------------------------------------------------------------

std::string why(const SyntheticRecording& recording, const EventFusionOptions& options) {
  MappingSession session(options);
  EXPECT_TRUE(mapAll(session, recording).empty());
  return whyNoKeyframe(session.status(), options.mapper);
}

TEST(WhyNoKeyframe, SaysByHowMuchPosesAndEventsMissEachOther) {
  SyntheticRecording recording(0.4, 1);
  recording.events[0].resize(1);
  recording.events[0][0].t_ns = 10'100'000'000;
  for (StampedPose& pose : recording.poses) pose.t_ns += 5'000'000'000;

  EXPECT_EQ(why(recording, syntheticOptions()),
            "the events span 10.100000000 to 10.100000000 s, the poses 15.000000000 to "
            "15.400000000 s: they miss each other by 4.900000000 s");

  for (StampedPose& pose : recording.poses) pose.t_ns -= 10'000'000'000;
  EXPECT_THAT(why(recording, syntheticOptions()), HasSubstr("miss each other by 4.700000000 s"));
}

TEST(WhyNoKeyframe, SaysThatTheFiltersLeftNothing) {
  EventFusionOptions options = syntheticOptions();
  options.mapper.filter.background_activity_s = 1e-9;
  const SyntheticRecording recording;
  EXPECT_THAT(why(recording, options),
              HasSubstr("the filters took all " + std::to_string(recording.totalEvents()) +
                        " events of the selected cameras for noise"));
}

TEST(WhyNoKeyframe, SaysWhatIsMissingAltogether) {
  SyntheticRecording recording;
  recording.poses.clear();
  EXPECT_EQ(why(recording, syntheticOptions()), "the recording has no poses");
  recording.events.assign(2, {});
  EXPECT_EQ(why(recording, syntheticOptions()), "the recording has no events");
}

TEST(WhyNoKeyframe, SaysThatTheRecordingIsShorterThanAWindow) {
  EventFusionOptions options = syntheticOptions();
  options.mapper.keyframes.window_s = 2;
  EXPECT_THAT(why(SyntheticRecording(), options),
              AllOf(HasSubstr("no window of 2.000000000 s (window_s) was full"),
                    HasSubstr("the poses 10.000000000 to 10.500000000 s")));
}

TEST(WhyNoKeyframe, SaysThatWindowsHadNoPoseWhereTheyNeedOne) {
  SyntheticRecording recording;
  EventFusionOptions options = syntheticOptions();
  std::vector<StampedPose>& poses = recording.poses;  // the tracker is lost for 0.4 s
  poses.erase(poses.begin() + 6, poses.begin() + 45);
  EXPECT_THAT(why(recording, options), HasSubstr("had no pose at their reference times"));

  options.mapper.only_window = Window{10'000'000'000, 10'500'000'000, 500'000'000};
  EXPECT_THAT(why(recording, options),
              HasSubstr("no pose at the reference time 0.500000000 s of the window"));
}

TEST(WhyNoKeyframe, SaysThatTheWindowHasNoEvents) {
  EventFusionOptions options = syntheticOptions();
  options.mapper.only_window = Window{0, 1'000'000'000, 500'000'000};
  EXPECT_THAT(why(SyntheticRecording(), options),
              HasSubstr("no event in the window 0.000000000 to 1.000000000 s; the events span"));
}

}  // namespace
}  // namespace efm
