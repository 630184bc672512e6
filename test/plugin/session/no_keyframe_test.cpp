// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/session/no_keyframe.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "test/plugin/session/session_driver.h"

namespace efm {
namespace {

using testing::AllOf;
using testing::HasSubstr;

std::string why(const SyntheticRecording& recording, const EventFusionOptions& options) {
  MappingSession session(options);
  EXPECT_TRUE(mapAll(session, recording).empty());
  return whyNoKeyframe(session.status(), options.mapper);
}

TEST(WhyNoKeyframe, SaysTheGapBetweenPosesAndEvents) {
  SyntheticRecording recording(0.4, 1);
  recording.events[0].resize(1);
  recording.events[0][0].t_ns = 10'100'000'000;
  for (StampedPose& pose : recording.poses) pose.t_ns += 5'000'000'000;

  EXPECT_EQ(
      why(recording, syntheticOptions()),
      "the events span 10.100000000 to 10.100000000 s (+0 to +0 s), the poses 15.000000000 to "
      "15.400000000 s (+4.9 to +5.3 s): they miss each other by 4.900000000 s");

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

TEST(WhyNoKeyframe, SaysThatTheLensSeesNoEvent) {
  SyntheticRecording recording;
  for (RigCamera& camera : recording.cameras) {
    camera.model.distortion = DistortionModel::kRadtan;
    camera.model.coefficients = {-1000, 0, 0, 0};
    camera.model.cx = camera.model.cy = 0;  // the lens sees some pixels of this corner
  }
  const std::string events = std::to_string(recording.totalEvents());
  EXPECT_THAT(why(recording, syntheticOptions()),
              HasSubstr(events + " of " + events + " events lie outside the lens"));
}

TEST(WhyNoKeyframe, SaysThatEventsOrPosesAreMissing) {
  SyntheticRecording recording;
  recording.poses.clear();
  EXPECT_EQ(why(recording, syntheticOptions()),
            "the recording has no poses: a map needs --poses FILE");
  recording.events.assign(2, {});
  EXPECT_EQ(why(recording, syntheticOptions()), "the recording has no events");
}

TEST(WhyNoKeyframe, SaysThatTheRecordingIsShorterThanAWindow) {
  EventFusionOptions options = syntheticOptions();
  options.mapper.policy.window_s = 2;
  EXPECT_THAT(why(SyntheticRecording(), options),
              AllOf(HasSubstr("no window of 2.000000000 s (window_s) was full"),
                    HasSubstr("the poses 10.000000000 to 10.500000000 s")));
}

TEST(WhyNoKeyframe, SaysThatWindowsHadNoPoseAtTheirReferenceTime) {
  SyntheticRecording recording;
  EventFusionOptions options = syntheticOptions();
  std::vector<StampedPose>& poses = recording.poses;  // the tracker is lost for 0.4 s
  poses.erase(poses.begin() + 6, poses.begin() + 45);
  EXPECT_THAT(why(recording, options), HasSubstr("had no pose at their reference times"));

  options.mapper.only_window = Window{10'000'000'000, 10'500'000'000, 500'000'000};
  EXPECT_THAT(why(recording, options),
              HasSubstr("no pose at the reference time 0.500000000 s (-9.502 s) of the window"));
}

TEST(WhyNoKeyframe, SaysThatTheWindowHasNoEvents) {
  EventFusionOptions options = syntheticOptions();
  options.mapper.only_window = Window{0, 1'000'000'000, 500'000'000};
  EXPECT_THAT(why(SyntheticRecording(), options),
              HasSubstr("no event in the window 0.000000000 to 1.000000000 s (-10.002 to -9.002 "
                        "s); the events span"));
}

}  // namespace
}  // namespace efm
