// SPDX-License-Identifier: BSD-3-Clause
// Three cameras that look in different directions see more than two of them.
#include <gtest/gtest.h>

#include <iostream>
#include <vector>

#include "test/integration/simulated_recording.h"

namespace efm {
namespace {

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
    EXPECT_EQ(keyframes.size(), 2U);  // the second one ends with the recording
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
