// SPDX-License-Identifier: BSD-3-Clause
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>
#include <utility>
#include <vector>

#include "mapping/keyframes/fusion_mapper.h"
#include "test/mapping/keyframes/random_scene.h"

namespace efm::edge_case_test {
namespace {

constexpr std::int64_t kMs = 1'000'000;
constexpr std::int64_t kStart_ns = 1'700'000'000'000'000'000;

FusionMapperOptions options(int planes = 4) {
  FusionMapperOptions options;
  options.keyframe.split = SplitFusionOptions::none();
  options.keyframe.extraction.extraction = ExtractionMethod::kPaper;
  options.policy.window_s = 0.1;
  options.policy.stride_s = 0.1;
  options.fill_last_window = false;  // a single window of 0.1 s in most of these recordings
  options.keyframe.planes = {0.5, 4.0, planes, PlaneSpacing::kInverse};
  options.keyframe.sweep.threads = 1;
  return options;
}

/// A sensor of any size that sees 60 degrees.
CameraModel sensor(int width, int height) {
  const double f = width / 1.1547;
  return {width, height, f, f, 0.5 * (width - 1), 0.5 * (height - 1), DistortionModel::kNone, {}};
}

Event eventAt(std::int64_t t_ns) { return {t_ns, 20, 20, true}; }

std::vector<KeyframeDepthMap> takeAll(FusionMapper& mapper) {
  std::vector<KeyframeDepthMap> keyframes;
  while (auto keyframe = mapper.next()) keyframes.push_back(std::move(*keyframe));
  return keyframes;
}

/// Cameras with random events and motion over a tenth of a second.
std::vector<KeyframeDepthMap> mapRandom(const FusionMapperOptions& options,
                                        const CameraModel& model, int cameras,
                                        MapperCounts* counts = nullptr) {
  test::RandomScene random(1);
  FusionMapper mapper(options);
  const Trajectory motion = random.motion(kStart_ns, 0.2, 1.0, 1.0);
  for (const StampedPose& pose : motion.poses()) mapper.addPose(pose);
  for (int c = 0; c < cameras; ++c) {
    mapper.addCamera({model, random.pose(0.05, 0.05), 0});
    mapper.addEvents(c, random.events(model, 3000, kStart_ns, 110 * kMs));
  }
  mapper.finish();
  auto keyframes = takeAll(mapper);
  if (counts != nullptr) *counts = mapper.counts();
  return keyframes;
}

TEST(EdgeCase, AnEventAtT1IsOutsideAndOneANanosecondBeforeInside) {
  FusionMapperOptions single = options();
  single.only_window = Window{kStart_ns, kStart_ns + 100 * kMs, kStart_ns + 50 * kMs};
  single.keyframe.subintervals.count = 3;
  FusionMapper mapper(single);
  mapper.addCamera({test::smallCamera(), {}, 0});
  for (int i = -1; i <= 12; ++i) mapper.addPose({kStart_ns + i * 10 * kMs, {}});
  mapper.addEvents(0, {eventAt(kStart_ns - 1), eventAt(kStart_ns),
                       eventAt(kStart_ns + 100 * kMs - 1), eventAt(kStart_ns + 100 * kMs)});
  mapper.finish();
  const auto keyframes = takeAll(mapper);
  ASSERT_EQ(keyframes.size(), 1U);
  EXPECT_EQ(keyframes[0].events[0], 2U);
  EXPECT_EQ(keyframes[0].silent_subintervals, 1U) << "the one in the middle";
  EXPECT_EQ(mapper.counts().total().outside_window, 2U);
}

TEST(EdgeCase, APoseAtTheTimeOfAnEventServesItBetweenGaps) {
  FusionMapperOptions single = options();
  single.trajectory.max_pose_gap_s = 0.02;
  single.only_window = Window{kStart_ns, kStart_ns + 100 * kMs, kStart_ns + 50 * kMs};
  FusionMapper mapper(single);
  mapper.addCamera({test::smallCamera(), {}, 0});
  // The pose in the middle lies between two gaps.
  for (const int ms : {0, 50, 100}) mapper.addPose({kStart_ns + ms * kMs, {}});
  mapper.addEvents(0, {eventAt(kStart_ns), eventAt(kStart_ns + 50 * kMs - 1),
                       eventAt(kStart_ns + 50 * kMs), eventAt(kStart_ns + 50 * kMs + 1)});
  mapper.finish();
  const auto keyframes = takeAll(mapper);
  ASSERT_EQ(keyframes.size(), 1U);
  EXPECT_EQ(keyframes[0].events[0], 2U);
  EXPECT_EQ(keyframes[0].without_pose, 2U);
  EXPECT_EQ(mapper.counts().total().without_pose, 2U);
  EXPECT_EQ(mapper.counts().total().used, 2U);
}

TEST(EdgeCase, ASinglePoseMakesNoWindowExceptTheOnlyWindow) {
  for (const bool asked_for : {false, true}) {
    for (const auto policy : {KeyframePolicyKind::kPeriod, KeyframePolicyKind::kEvents,
                              KeyframePolicyKind::kBaseline}) {
      FusionMapperOptions one_pose = options();
      one_pose.policy.policy = policy;
      one_pose.policy.window_events = 1;
      const std::int64_t t_ns = kStart_ns + 50 * kMs;
      if (asked_for) one_pose.only_window = Window{kStart_ns, kStart_ns + 100 * kMs, t_ns};
      FusionMapper mapper(one_pose);
      mapper.addCamera({test::smallCamera(), {}, 0});
      mapper.addPose({t_ns, {}});
      mapper.addEvents(0, {eventAt(t_ns - 1), eventAt(t_ns), eventAt(t_ns), eventAt(t_ns + 1)});
      mapper.finish();
      const auto keyframes = takeAll(mapper);
      ASSERT_EQ(keyframes.size(), asked_for ? 1U : 0U);
      const EventCounts total = mapper.counts().total();
      EXPECT_EQ(total.without_pose, 2U);
      EXPECT_EQ(total.used, asked_for ? 2U : 0U);
      EXPECT_EQ(total.outside_window, asked_for ? 0U : 2U);
    }
  }
}

TEST(EdgeCase, OnePlaneGivesItsDepthEverywhere) {
  for (const PlaneSpacing spacing : {PlaneSpacing::kInverse, PlaneSpacing::kLinear}) {
    FusionMapperOptions one_plane = options(1);
    one_plane.keyframe.planes.spacing = spacing;
    MapperCounts counts;
    const auto keyframes = mapRandom(one_plane, test::smallCamera(), 2, &counts);
    ASSERT_EQ(keyframes.size(), 1U);
    const DepthMap& map = keyframes[0].map;
    EXPECT_GT(cv::countNonZero(map.depth), 10);
    EXPECT_EQ(cv::countNonZero(map.depth), cv::countNonZero(map.depth == 0.5F));
    for (int i = 0; i < static_cast<int>(map.depth.total()); ++i) {
      const bool kept = map.depth(i) > 0;
      EXPECT_TRUE(kept ? std::isinf(map.variance(i)) : map.variance(i) == 0);
    }
    EXPECT_EQ(counts.votes.total(), counts.event_uses);
  }
}

TEST(EdgeCase, FiveHundredPlanesAreAllVoted) {
  MapperCounts counts;
  const auto keyframes = mapRandom(options(500), test::smallCamera(), 2, &counts);
  ASSERT_EQ(keyframes.size(), 1U);
  EXPECT_GT(cv::countNonZero(keyframes[0].map.depth), 10);
  double nearest = 0;
  double farthest = 0;
  cv::minMaxLoc(keyframes[0].map.depth, &nearest, &farthest, nullptr, nullptr,
                keyframes[0].map.depth > 0);
  EXPECT_GE(nearest, 0.5);
  EXPECT_LE(farthest, 4.0);
  EXPECT_EQ(counts.votes.total(), counts.event_uses * 500);
}

TEST(EdgeCase, SensorsDownToOnePixelAreMapped) {
  for (const auto& [width, height] :
       std::vector<std::pair<int, int>>{{16, 16}, {5, 5}, {4, 7}, {3, 3}, {2, 2}, {1, 9}, {1, 1}}) {
    FusionMapperOptions small = options();
    small.keyframe.extraction.dilate = true;
    small.keyframe.camera_maps = true;
    small.keyframe.event_images = true;
    MapperCounts counts;
    const auto keyframes = mapRandom(small, sensor(width, height), 2, &counts);
    ASSERT_EQ(keyframes.size(), 1U) << width << "x" << height;
    const KeyframeDepthMap& keyframe = keyframes[0];
    EXPECT_EQ(keyframe.map.depth.size(), cv::Size(width, height));
    EXPECT_EQ(keyframe.camera_maps.at(1).map.depth.size(), cv::Size(width, height));
    EXPECT_EQ(keyframe.event_images.at(1).counts.size(), cv::Size(width, height));
    EXPECT_EQ(counts.votes.total(), counts.event_uses * 4);
    EXPECT_GT(counts.event_uses, 0U);
    if (width < 5) {
      EXPECT_EQ(cv::countNonZero(keyframe.map.depth), 0) << "all frame, no picture";
    }
    if (width == 1) {
      EXPECT_EQ(counts.votes.cast, 0U) << "a vote needs two columns";
    } else {
      EXPECT_GT(counts.votes.cast, 0U);
    }
    if (width == 16) {
      EXPECT_GT(cv::countNonZero(keyframe.map.depth), 0);
    }
  }
}

TEST(EdgeCase, ACameraWithoutEventsMakesAndLikeRulesZeroUnlessItIsExcluded) {
  test::RandomScene random(2);
  const auto events = random.events(test::smallCamera(), 3000, kStart_ns, 110 * kMs);
  for (const FusionRule rule : allFusionRules()) {
    for (const bool exclude : {false, true}) {
      FusionMapperOptions two = options();
      two.keyframe.sweep.fusion.across_cameras = rule;
      two.keyframe.exclude_silent = exclude;
      FusionMapper mapper(two);
      for (int c = 0; c < 2; ++c) mapper.addCamera({test::smallCamera(), {}, 0});
      for (int i = 0; i <= 20; ++i) mapper.addPose({kStart_ns + i * 10 * kMs, {}});
      mapper.addEvents(0, events);
      mapper.finish();
      const auto keyframes = takeAll(mapper);
      ASSERT_EQ(keyframes.size(), 1U);
      EXPECT_THAT(keyframes[0].silent_cameras, ::testing::ElementsAre(1));
      const bool and_like = rule == FusionRule::kMin || rule == FusionRule::kHarmonic ||
                            rule == FusionRule::kGeometric;
      EXPECT_EQ(keyframes[0].max_confidence == 0, and_like && !exclude) << nameOf(rule);
    }
  }
}

TEST(EdgeCase, TheLastWindowIsFullAndEndsWithTheRecording) {
  struct Case {
    const char* what;
    double window_s, stride_s;
    int poses_ms, events_ms;  // an event every millisecond, a pose every 10 ms, until here
    std::int64_t limit_ms;    // of the time, or 0
    std::size_t keyframes;
    int last_begin_ms, last_end_ms;  // the events of the last window
    std::uint64_t used;
  };
  for (const Case& c :
       {Case{"moved back", 0.1, 0.1, 400, 270, 0, 3, 170, 270, 270},
        {"a tenth is new", 0.1, 0.1, 400, 211, 0, 3, 111, 211, 211},
        {"less than a tenth is new", 0.1, 0.1, 400, 210, 0, 2, 100, 200, 200},
        {"the strides fit", 0.1, 0.1, 400, 201, 200, 2, 100, 200, 200},
        {"overlapping windows", 0.1, 0.04, 400, 305, 0, 7, 205, 305, 305},
        {"overlapping windows, less is new", 0.1, 0.04, 400, 304, 0, 6, 200, 300, 300},
        {"overlapping windows that fit", 0.1, 0.05, 400, 301, 300, 5, 200, 300, 300},
        {"windows apart, in the third", 0.05, 0.1, 400, 230, 0, 3, 180, 230, 150},
        {"windows apart, between them", 0.05, 0.1, 400, 195, 0, 2, 100, 150, 100},
        {"poses end first", 0.1, 0.1, 250, 330, 0, 3, 150, 250, 250},
        {"a limit", 0.1, 0.1, 400, 330, 260, 3, 160, 260, 260},
        {"shorter than a window", 0.1, 0.1, 400, 99, 0, 0, 0, 0, 0}}) {
    FusionMapperOptions period = options();
    period.fill_last_window = true;
    period.filter.hot_pixels = false;
    period.policy.window_s = c.window_s;
    period.policy.stride_s = c.stride_s;
    if (c.limit_ms > 0) period.limits.t1_ns = kStart_ns + c.limit_ms * kMs;
    FusionMapper mapper(period);
    mapper.addCamera({test::smallCamera(), {}, 0});
    std::vector<KeyframeDepthMap> keyframes;
    for (int ms = 0; ms < std::max(c.poses_ms + 10, c.events_ms); ++ms) {
      if (ms % 10 == 0 && ms <= c.poses_ms) mapper.addPose({kStart_ns + ms * kMs, {}});
      if (ms < c.events_ms) mapper.addEvents(0, {eventAt(kStart_ns + ms * kMs)});
      for (auto& keyframe : takeAll(mapper)) keyframes.push_back(std::move(keyframe));
    }
    mapper.finish();
    for (auto& keyframe : takeAll(mapper)) keyframes.push_back(std::move(keyframe));
    ASSERT_EQ(keyframes.size(), c.keyframes) << c.what;
    EXPECT_EQ(mapper.counts().total().used, c.used) << c.what;
    if (keyframes.empty()) continue;
    const Window last = keyframes.back().window;
    const auto length_ms = static_cast<int>(1e3 * c.window_s);
    EXPECT_EQ(last.t1_ns - last.t0_ns, length_ms * kMs) << c.what;
    EXPECT_EQ(keyframes.back().events[0], static_cast<std::uint64_t>(length_ms)) << c.what;
    // Right after its last event, or at a multiple of the stride.
    EXPECT_GT(last.t1_ns, kStart_ns + (c.last_end_ms - 1) * kMs) << c.what;
    EXPECT_LE(last.t1_ns, kStart_ns + c.last_end_ms * kMs) << c.what;
    EXPECT_GT(last.t0_ns, kStart_ns + (c.last_begin_ms - 1) * kMs) << c.what;
    EXPECT_LE(last.t0_ns, kStart_ns + c.last_begin_ms * kMs) << c.what;
  }
}

TEST(EdgeCase, TheLastWindowReachesNotIntoEventsThatWereGivenUp) {
  for (const auto& [until_ms, keyframes] : {std::pair{150, 1U}, std::pair{190, 0U}}) {
    FusionMapperOptions period = options();
    period.fill_last_window = true;
    period.filter.hot_pixels = false;
    FusionMapper mapper(period);
    mapper.addCamera({test::smallCamera(), {}, 0});
    for (int i = 0; i <= 40; ++i) mapper.addPose({kStart_ns + i * 10 * kMs, {}});
    std::vector<Event> events;
    for (int ms = 0; ms < 280; ++ms) events.push_back(eventAt(kStart_ns + ms * kMs));
    mapper.addEvents(0, events);
    ASSERT_TRUE(mapper.nextWindow());
    mapper.giveUpBefore(kStart_ns + until_ms * kMs, &WindowsGivenUp::overload);
    mapper.finish();
    EXPECT_EQ(takeAll(mapper).size(), keyframes) << until_ms;
  }
}

}  // namespace
}  // namespace efm::edge_case_test
