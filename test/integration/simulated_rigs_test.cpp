// SPDX-License-Identifier: BSD-3-Clause
// Tests the whole method on simulated rigs other than the desk's.
#include <gtest/gtest.h>

#include <iostream>
#include <utility>
#include <vector>

#include "test/integration/simulated_recording.h"

namespace efm {
namespace {

TEST(RoomStereo, TheMapLiesOnTheTrueSurfaces) {
  SimulationOptions simulation;
  simulation.preset = "room_stereo";
  simulation.duration_s = 1.6;  // of 8 s around the room; 8 s take five times as long
  const test::SimulatedRecording room(simulation);
  FusionMapperOptions options;
  options.policy.window_s = 0.3;
  options.policy.stride_s = 0.3;
  options.keyframe.planes = {0.9, 7.0, 100, PlaneSpacing::kInverse};

  const auto keyframes = room.map(options);
  EXPECT_EQ(keyframes.size(), 6U);  // the last window is moved back to the end
  const auto points = test::globalCloudOf(keyframes);
  ASSERT_GT(points->size(), 10'000U);
  const double median_m = room.medianDistanceToSurfaces(*points);
  std::cout << "map: " << points->size() << " points, median distance to the surfaces "
            << 100 * median_m << " cm\n";
  // A plane step is 1 % of the range of inverse depth: 2 cm at 1.4 m, 9 cm at 3 m.
  EXPECT_LE(median_m, 0.06);

  // The check between keyframes removes outliers and few other points.
  GlobalCloudOptions map;
  const double share = room.shareBeyond(*points, 0.2);
  map.consistency.consistency = Consistency::kNone;
  const auto all = test::globalCloudOf(keyframes, map);
  const double share_of_all = room.shareBeyond(*all, 0.2);
  map.consistency.consistency = Consistency::kVisibility;
  map.min_keyframes = 2;
  const auto seen_twice = test::globalCloudOf(keyframes, map);
  const double share_of_seen_twice = room.shareBeyond(*seen_twice, 0.2);
  std::cout << "beyond 20 cm: " << share_of_all << " of all " << all->size() << " points, " << share
            << " by visibility, " << share_of_seen_twice << " of the " << seen_twice->size()
            << " that two keyframes saw\n";
  EXPECT_LT(share, 0.85 * share_of_all);
  EXPECT_GT(points->size(), all->size() * 97 / 100);
  EXPECT_LT(share_of_seen_twice, 0.02);
  EXPECT_GT(seen_twice->size(), all->size() * 80 / 100);
}

/// The three cameras look in different directions.
TEST(Trinocular, ThreeCamerasAreSurerThanTwoWhereAllVote) {
  SimulationOptions simulation;
  simulation.preset = "trinocular";
  simulation.duration_s = 0.25;
  const test::SimulatedRecording recording(simulation);
  const auto keyframe = [&](const std::vector<int>& cameras) {
    FusionMapperOptions options;
    options.cameras = cameras;
    options.keyframe.planes = {0.5, 5.0, 100, PlaneSpacing::kInverse};
    options.keyframe.sweep.fusion.across_cameras = FusionRule::kHarmonic;
    options.keyframe.camera_maps = true;
    auto keyframes = recording.map(options);
    EXPECT_EQ(keyframes.size(), 2U);  // the second window ends with the recording
    return std::move(keyframes.at(0));
  };
  const KeyframeDepthMap all = keyframe({0, 1, 2});
  ASSERT_EQ(all.camera_maps.size(), 3U);
  cv::Mat1b every_camera_votes(all.map.depth.size(), 255);
  for (const CameraDepthMap& camera : all.camera_maps) {
    every_camera_votes &= camera.map.confidence > 0;
  }
  EXPECT_GT(cv::countNonZero(every_camera_votes), 100'000) << "of 307,200 pixels";

  const auto median_error = [&](KeyframeDepthMap of, const char* name) {
    of.map.depth.setTo(0, ~every_camera_votes);
    const DepthErrors errors = depthErrors(recording.pairs(of));
    std::cout << name << ": median error " << 100 * errors.median_abs_m << " cm of "
              << errors.points << " points\n";
    EXPECT_GT(errors.points, 1000U) << name;
    return errors.median_abs_m;
  };
  const double of_all = median_error(all, "0+1+2");
  EXPECT_LT(of_all, median_error(keyframe({0, 1}), "0+1"));
  EXPECT_LT(of_all, median_error(keyframe({0, 2}), "0+2"));
}

}  // namespace
}  // namespace efm
