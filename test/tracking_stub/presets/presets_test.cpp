// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <ostream>
#include <string>

#include "mapping/geometry/trajectory.h"
#include "test/tracking_stub/presets/visible_depths.h"
#include "tracking_stub/presets/presets.h"

namespace efm {
namespace {

/// The promised values of a preset.
struct Promise {
  std::string preset;
  std::size_t cameras;
  int width, height;
  double min_depth_m, max_depth_m;
  double sky = 0;  // max fraction of the pixels
};

std::ostream& operator<<(std::ostream& out, const Promise& promise) {
  return out << promise.preset;
}

class Presets : public ::testing::TestWithParam<Promise> {};

/// The max distance between the pixel of an event and the projection of its source.
double maxSourceError(const Simulation& simulation, std::size_t c,
                      const CameraRecording& recording) {
  const RigCamera& camera = simulation.rig.cameras[c];
  double max_px = 0;
  for (std::size_t i = 0; i < recording.events.size(); i += 11) {
    const Event& event = recording.events[i];
    const Rigid3 T_world_cam = simulation.motion->poseAt(event.t_ns) * camera.T_rig_cam;
    const Eigen::Vector3d p_world = simulation.scene.pointAt(recording.sources[i]);
    const Eigen::Vector2d pixel = camera.model.project(T_world_cam.inverse() * p_world);
    max_px = std::max(max_px, (pixel - Eigen::Vector2d(event.x, event.y)).norm());
  }
  return max_px;
}

TEST_P(Presets, KeepWhatTheyPromise) {
  const Promise& promise = GetParam();
  SimulationOptions options;
  options.preset = promise.preset;
  Simulation simulation = makeSimulation(options);
  ASSERT_EQ(simulation.rig.cameras.size(), promise.cameras);
  for (const RigCamera& camera : simulation.rig.cameras) {
    EXPECT_EQ(camera.model.width, promise.width);
    EXPECT_EQ(camera.model.height, promise.height);
    const test::VisibleDepths depths = test::visibleDepths(simulation, camera);
    EXPECT_GE(depths.nearest, promise.min_depth_m);
    EXPECT_LE(depths.farthest, promise.max_depth_m);
    EXPECT_LE(depths.sky, promise.sky);
  }
  if (promise.preset == "desk_stereo") EXPECT_EQ(simulation.duration_ns, 2'000'000'000);
  if (promise.preset == "room_stereo") {  // it ends at its first pose
    const Rigid3 T_begin_end = simulation.motion->poseAt(simulation.start_ns).inverse() *
                               simulation.motion->poseAt(simulation.endNs());
    EXPECT_LT(T_begin_end.translation.norm(), 1e-6);
    EXPECT_LT(T_begin_end.rotation.angularDistance(Eigen::Quaterniond::Identity()), 1e-6);
  }
  // In the first 4 ms, sources project to their pixels within half a pixel and the motion of a
  // step.
  simulation.duration_ns = 4'000'000;
  const auto recordings = simulateEvents(simulation);
  for (std::size_t c = 0; c < recordings.size(); ++c) {
    EXPECT_GT(recordings[c].events.size(), 100U);
    EXPECT_LT(maxSourceError(simulation, c, recordings[c]),
              std::sqrt(0.5) + simulation.max_step_px);
  }
}

INSTANTIATE_TEST_SUITE_P(All, Presets,
                         ::testing::Values(Promise{"desk_stereo", 2, 346, 260, 0.6, 4.5},
                                           Promise{"slider", 1, 240, 180, 0.5, 2.4},
                                           Promise{"poles_stereo", 2, 346, 260, 0.85, 4.2},
                                           Promise{"drive_stereo", 2, 640, 480, 4, 50, 0.35},
                                           Promise{"hd_stereo", 2, 1280, 720, 0.8, 5},
                                           Promise{"room_stereo", 2, 346, 260, 0.9, 7},
                                           Promise{"trinocular", 3, 640, 480, 0.7, 5}),
                         [](const auto& preset) { return preset.param.preset; });

TEST(DeskStereo, PosesInterpolateToFarBelowAHundredthOfAPixel) {
  const Simulation desk = makeDeskStereo(1);
  Trajectory trajectory;
  for (const StampedPose& pose : samplePoses(desk)) trajectory.add(pose);
  const Eigen::Vector3d p_cam(0.3, 0.2, 0.6);  // at the min depth
  for (std::int64_t t_ns = desk.start_ns + 500'000; t_ns < desk.endNs(); t_ns += 7'000'000) {
    const Eigen::Vector3d p_world = desk.motion->poseAt(t_ns) * p_cam;
    const Eigen::Vector3d p_interpolated = trajectory.poseAt(t_ns)->inverse() * p_world;
    const CameraModel& model = desk.rig.cameras[0].model;
    EXPECT_LT((model.project(p_interpolated) - model.project(p_cam)).norm(), 0.002);
  }
}

}  // namespace
}  // namespace efm
