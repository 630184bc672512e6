// SPDX-License-Identifier: BSD-3-Clause
#include <gmock/gmock.h>
#include <opencv2/core.hpp>

#include <algorithm>
#include <stdexcept>
#include <string>
#include <vector>

#include "mapping/events/event.h"
#include "mapping/keyframes/keyframe_mapper.h"
#include "test/mapping/depth/same_image.h"
#include "test/mapping/keyframes/played_recording.h"
#include "test/mapping/keyframes/random_scene.h"

namespace efm::keyframe_mapper_test {
namespace {

using test::map;
using test::same;
using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::ThrowsMessage;
using Recording = test::RandomRecording;

KeyframeMapperOptions fewPlanes(int subintervals = 1) {
  KeyframeMapperOptions options;
  options.split = SplitFusionOptions::none();
  options.extraction.extraction = ExtractionMethod::kPaper;
  options.planes = {0.5, 4.0, 8, PlaneSpacing::kInverse};
  options.subintervals.count = subintervals;
  options.sweep.threads = 1;
  return options;
}

TEST(KeyframeMapper, AnUnselectedReferenceGivesTheViewButNoneOfItsEvents) {
  Recording recording(2, 3, 3000);
  KeyframeMapperOptions options = fewPlanes(2);
  options.reference_camera = 2;
  options.camera_maps = true;
  options.event_images = true;
  const KeyframeDepthMap with_events = map(recording, {0, 1}, options);
  recording.events[2].clear();
  const KeyframeDepthMap without = map(recording, {0, 1}, options);
  EXPECT_TRUE(same(with_events.map, without.map));
  EXPECT_GT(cv::countNonZero(without.map.depth), 0);
  EXPECT_THAT(with_events.events, ElementsAre(3000, 3000, 0));
  EXPECT_THAT(with_events.silent_cameras, IsEmpty()) << "an unselected camera is not silent";
  ASSERT_EQ(with_events.camera_maps.size(), 2U);
  ASSERT_EQ(with_events.event_images.size(), 2U);
  EXPECT_EQ(with_events.event_images[1].camera, 1);
}

TEST(KeyframeMapper, SingleCamerasMapsAreThoseOfARunWithThisCameraAlone) {
  const Recording recording(3, 3, 4000);
  for (const int subintervals : {1, 4}) {
    KeyframeMapperOptions options = fewPlanes(subintervals);
    options.reference_camera = 1;
    const KeyframeDepthMap plain = map(recording, {0, 2}, options);
    EXPECT_THAT(plain.camera_maps, IsEmpty());
    options.camera_maps = true;
    const KeyframeDepthMap all = map(recording, {0, 2}, options);
    EXPECT_TRUE(same(all.map, plain.map)) << "beside the fused one, which stays";
    ASSERT_EQ(all.camera_maps.size(), 2U);
    EXPECT_EQ(all.camera_maps[0].camera, 0);
    EXPECT_EQ(all.camera_maps[1].camera, 2);
    for (const CameraDepthMap& camera : all.camera_maps) {
      const KeyframeDepthMap alone = map(recording, {camera.camera}, options);
      EXPECT_TRUE(same(camera.map, alone.map)) << camera.camera << " of " << subintervals;
      EXPECT_TRUE(same(camera.map, alone.camera_maps.at(0).map));
    }
  }
}

TEST(KeyframeMapper, OverItsBudgetACameraGivesAnEvenChoiceOfItsEvents) {
  const Recording recording(7, 2, 3000);
  KeyframeMapperOptions options = fewPlanes();
  options.event_images = true;
  const KeyframeDepthMap all = map(recording, {0, 1}, options);
  Recording chosen = recording;
  for (std::vector<Event>& events : chosen.events) {
    std::vector<Event> some;
    const EvenChoice choice(events.size(), 1000);
    for (std::size_t k = 0; k < choice.size(); ++k) some.push_back(events[choice[k]]);
    events = some;
  }
  const KeyframeDepthMap expected = map(chosen, {0, 1}, options);
  options.max_events_per_camera = 1000;
  const KeyframeDepthMap limited = map(recording, {0, 1}, options);
  EXPECT_TRUE(same(limited.map, expected.map));
  EXPECT_THAT(limited.events, ElementsAre(1000, 1000));
  EXPECT_EQ(limited.over_budget, 4000U);
  EXPECT_TRUE(same(limited.event_images[0].counts, all.event_images[0].counts))
      << "the picture shows all events";
  options.max_events_per_camera = 3000;
  const KeyframeDepthMap within = map(recording, {0, 1}, options);
  EXPECT_TRUE(same(within.map, all.map));
  EXPECT_EQ(within.over_budget, 0U);
}

TEST(KeyframeMapper, ASequenceMaximumThatIsKnownIsTheWhiteLevel) {
  const Recording recording(14, 2, 4000);
  KeyframeMapperOptions options = fewPlanes();
  options.extraction.max_confidence = MaxConfidence::of(30);
  const KeyframeDepthMap fixed = map(recording, {0, 1}, options);
  options.extraction.max_confidence.level = WhiteLevel::kSequence;
  EXPECT_FALSE(same(map(recording, {0, 1}, options).map.depth, fixed.map.depth));
  options.sequence_maximum = 30;
  EXPECT_TRUE(same(map(recording, {0, 1}, options).map, fixed.map));
}

TEST(KeyframeMapper, EventImagesCountEveryEventOfTheWindowWithAPoseOrWithout) {
  Recording recording(4, 2, 3000);
  Trajectory half;  // poses of the first half of the window only
  for (const StampedPose& pose : recording.trajectory.poses()) {
    if (pose.t_ns <= Recording::kStart_ns + 60'000'000) half.add(pose);
  }
  recording.trajectory = half;
  KeyframeMapperOptions options = fewPlanes();
  options.view.width = 96;
  EXPECT_THAT(map(recording, {0, 1}, options).event_images, IsEmpty());
  options.event_images = true;
  const KeyframeDepthMap keyframe = map(recording, {0, 1}, options);
  EXPECT_GT(keyframe.without_pose, 0U);
  EXPECT_EQ(keyframe.events[0] + keyframe.events[1] + keyframe.without_pose, 6000U);
  ASSERT_EQ(keyframe.event_images.size(), 2U);
  for (std::size_t c = 0; c < 2; ++c) {
    const EventImage& image = keyframe.event_images[c];
    EXPECT_EQ(image.camera, static_cast<int>(c));
    cv::Mat_<cv::Vec2i> expected = cv::Mat_<cv::Vec2i>::zeros(36, 48);
    for (const Event& event : recording.events[c]) {
      expected(event.y, event.x)[event.polarity ? 1 : 0] += 1;
    }
    EXPECT_TRUE(same(image.counts, expected)) << "of the sensor, not of the view";
  }
}

TEST(KeyframeMapper, ViewEventsAreTheReferenceCamerasNearestToTheReferenceTimeWithoutDistortion) {
  Recording recording(5, 2, 3000);
  KeyframeMapperOptions options = fewPlanes();
  options.reference_camera = 1;
  options.view.width = 60;
  options.view.fov_deg = 40;  // narrower than the camera
  EXPECT_TRUE(map(recording, {0, 1}, options).view_events.empty());
  options.view_events = true;
  EXPECT_TRUE(map(recording, {0}, options).view_events.empty()) << "it is not selected";

  std::vector<Event>& events = recording.events[1];
  const UndistortionTable table(recording.rig.cameras[1].model);
  const auto first_after = std::count_if(events.begin(), events.end(), [](const Event& event) {
    return event.t_ns < Recording::kWindow.t_ref_ns;
  });
  const std::ptrdiff_t half = 48 * 36 / 8 / 2;  // one event per 8 pixels
  const std::vector<Event> nearest(events.begin() + first_after - half,
                                   events.begin() + first_after + half);
  // A window with few events uses all of them.
  const std::vector<Event> few(events.begin(), events.begin() + 100);
  for (const std::vector<Event>* shown : {&nearest, &few}) {
    if (shown == &few) events = few;
    const KeyframeDepthMap keyframe = map(recording, {0, 1}, options);
    cv::Mat_<cv::Vec2i> expected = cv::Mat_<cv::Vec2i>::zeros(keyframe.map.depth.size());
    int outside = 0;
    for (const Event& event : *shown) {
      const Eigen::Vector2d p = keyframe.view.project(table.ray(event.x, event.y).homogeneous());
      const cv::Point pixel(cvRound(p.x()), cvRound(p.y()));
      const bool inside = pixel.inside({{}, expected.size()});
      if (inside) ++expected(pixel)[event.polarity ? 1 : 0];
      outside += inside ? 0 : 1;
    }
    EXPECT_TRUE(same(keyframe.view_events, expected));
    EXPECT_GT(outside, 10);
    EXPECT_LT(outside, static_cast<int>(shown->size()) - 10);
  }
}

TEST(KeyframeMapper, AnExcludedSilentCameraChangesNothing) {
  Recording recording(6, 3, 4000);
  recording.events[1].clear();
  for (const auto shuffle :
       {SubintervalShuffle::kNone, SubintervalShuffle::kShift, SubintervalShuffle::kRandom}) {
    KeyframeMapperOptions options = fewPlanes(4);
    options.subintervals.shuffle = shuffle;
    options.camera_maps = true;
    const KeyframeDepthMap without = map(recording, {0, 2}, options);
    options.exclude_silent = true;
    const KeyframeDepthMap excluded = map(recording, {0, 1, 2}, options);
    EXPECT_TRUE(same(excluded.map, without.map)) << nameOf(shuffle);
    EXPECT_GT(cv::countNonZero(without.map.depth), 0);
    EXPECT_THAT(excluded.silent_cameras, ElementsAre(1));
    EXPECT_EQ(excluded.silent_subintervals, 0U) << "of the cameras that are not silent";
    EXPECT_EQ(excluded.votes.total(), without.votes.total());
    ASSERT_EQ(excluded.camera_maps.size(), 2U);
    EXPECT_EQ(excluded.camera_maps[1].camera, 2);
    EXPECT_TRUE(same(excluded.camera_maps[1].map, without.camera_maps[1].map));
    EXPECT_TRUE(same(map(recording, {0, 2}, options).map, without.map))
        << "where none is silent the option changes nothing";
  }
}

TEST(KeyframeMapper, EventsOutsideTheLensAreCountedAndChangeNothing) {
  Recording recording(12, 2, 3000);
  for (RigCamera& camera : recording.rig.cameras) camera.model = test::foldingCamera();
  const UndistortionTable undistortion(test::foldingCamera());
  Recording inside = recording;
  for (auto& events : inside.events) {
    const auto is_outside = [&](const Event& e) { return !undistortion.hasRay(e.x, e.y); };
    events.erase(std::remove_if(events.begin(), events.end(), is_outside), events.end());
  }
  const std::size_t outside = 6000 - inside.events[0].size() - inside.events[1].size();
  ASSERT_GT(outside, 500U);
  KeyframeMapperOptions options = fewPlanes();
  options.packets.packet_error_px = 0;  // otherwise the packets differ
  const KeyframeDepthMap all = map(recording, {0, 1}, options);
  const KeyframeDepthMap expected = map(inside, {0, 1}, options);
  EXPECT_EQ(all.outside_lens, outside);
  EXPECT_EQ(expected.outside_lens, 0U);
  EXPECT_EQ(all.events, expected.events);
  EXPECT_EQ(all.votes.total(), expected.votes.total());
  EXPECT_TRUE(same(all.map, expected.map));
}

TEST(KeyframeMapper, WhatIsNotValidIsNamed) {
  Recording recording(13, 3, 100);
  const auto expectError = [&](const Rig& rig, const std::vector<int>& cameras, int reference,
                               const char* message) {
    KeyframeMapperOptions options = fewPlanes();
    options.reference_camera = reference;
    EXPECT_THAT([&] { KeyframeMapper(rig, cameras, options); },
                ThrowsMessage<std::invalid_argument>(HasSubstr(message)));
  };
  expectError(recording.rig, {0, 1}, 3, "reference_camera = 3: must be a camera of the recording");
  expectError(recording.rig, {0, 1}, -1, "reference_camera = -1");
  expectError(recording.rig, {0, 3}, 0, "cameras = 3: must be a camera of the recording: 0 to 2");
  expectError(recording.rig, {0, -1}, 0, "cameras = -1");
  expectError(recording.rig, {}, 0, "cameras: at least one must take part");
  Rig broken = recording.rig;
  broken.cameras[1].model.fx = 0;
  expectError(broken, {0}, 1, "fx = 0");  // the reference camera is checked even if not selected
  expectError(broken, {0, 1}, 0, "fx = 0");
  EXPECT_NO_THROW(KeyframeMapper(broken, {0, 2}, fewPlanes()));
}

TEST(StageTimes, AKeyframeHasRaysSweepAndDepthAndMotionIfItIsCorrected) {
  const Recording recording(1, 2, 1000);
  KeyframeMapperOptions options = fewPlanes();
  for (const auto use : {MotionCorrectionUse::kNever, MotionCorrectionUse::kAlways}) {
    options.motion.correct_motion = use;
    KeyframeMapper mapper(recording.rig, {0, 1}, options);
    StageTimes times;
    mapper.map(Recording::kWindow, recording.spans(), recording.trajectory, nullptr, &times);
    for (const StageSeconds* const seconds : {&times.real, &times.cpu}) {
      EXPECT_GT(seconds->rays, 0);
      EXPECT_GT(seconds->sweep, 0);
      EXPECT_GT(seconds->depth, 0);
      EXPECT_EQ(seconds->motion > 0, use == MotionCorrectionUse::kAlways);
      EXPECT_EQ(seconds->filter, 0);
    }
  }
}

}  // namespace

}  // namespace efm::keyframe_mapper_test
