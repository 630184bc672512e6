// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <ostream>
#include <string>

#include "tracking_stub/presets/simulation_preset.h"
#include "tracking_stub/rendering/pixel_rays.h"
#include "tracking_stub/rendering/scene_view.h"

namespace efm {
namespace {

/// What a preset promises.
struct Promise {
  std::string preset;
  std::size_t cameras;
  int width, height;
  double min_depth_m, max_depth_m;
  double sky = 0;  // share of the pixels that may see nothing
};

std::ostream& operator<<(std::ostream& out, const Promise& promise) {
  return out << promise.preset;
}

class Presets : public ::testing::TestWithParam<Promise> {};

struct DepthRange {
  double nearest = 1e9;
  double farthest = 0;
  int rays = 0;
  int missed = 0;

  void look(const Scene& scene, const PixelRays& rays_of_camera, const Rigid3& T_world_cam) {
    const SceneView view(scene, T_world_cam, rays_of_camera.bounds());
    for (int y = 0; y < rays_of_camera.height(); y += 6) {
      for (int x = 0; x < rays_of_camera.width(); x += 6) {
        const ViewHit hit = view.cast(rays_of_camera(x, y).ray);
        ++rays;
        if (hit.surface < 0) {
          ++missed;
          continue;
        }
        nearest = std::min(nearest, 1 / hit.inverse_depth);
        farthest = std::max(farthest, 1 / hit.inverse_depth);
      }
    }
  }
};

/// The worst distance of an event's pixel from where its source place projects to.
double worstAttribution(const Simulation& simulation, std::size_t c,
                        const CameraRecording& recording) {
  const RigCamera& camera = simulation.rig.cameras[c];
  double worst_px = 0;
  for (std::size_t i = 0; i < recording.events.size(); i += 11) {
    const Event& event = recording.events[i];
    const Rigid3 T_world_cam = simulation.motion->poseAt(event.t_ns) * camera.T_rig_cam;
    const Eigen::Vector3d p_world = simulation.scene.pointAt(recording.sources[i]);
    const Eigen::Vector2d pixel = camera.model.project(T_world_cam.inverse() * p_world);
    worst_px = std::max(worst_px, (pixel - Eigen::Vector2d(event.x, event.y)).norm());
  }
  return worst_px;
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
    const PixelRays rays(camera.model);
    DepthRange range;
    for (int i = 0; i <= 50; ++i) {
      const std::int64_t t_ns = simulation.start_ns + simulation.duration_ns * i / 50;
      range.look(simulation.scene, rays, simulation.motion->poseAt(t_ns) * camera.T_rig_cam);
    }
    EXPECT_GE(range.nearest, promise.min_depth_m);
    EXPECT_LE(range.farthest, promise.max_depth_m);
    EXPECT_LE(range.missed, promise.sky * range.rays);
  }
  // A glimpse of the recording: what fires lies where lens and pose say, to within the pixel and
  // what the image moves in a step.
  simulation.duration_ns = 4'000'000;
  const auto recordings = simulateEvents(simulation);
  for (std::size_t c = 0; c < recordings.size(); ++c) {
    EXPECT_GT(recordings[c].events.size(), 100U);
    EXPECT_LT(worstAttribution(simulation, c, recordings[c]),
              std::sqrt(0.5) + simulation.max_step_px);
  }
}

INSTANTIATE_TEST_SUITE_P(All, Presets,
                         ::testing::Values(Promise{"slider", 1, 240, 180, 0.5, 2.4},
                                           Promise{"poles_stereo", 2, 346, 260, 0.85, 4.2},
                                           Promise{"drive_stereo", 2, 640, 480, 4, 50, 0.35},
                                           Promise{"hd_stereo", 2, 1280, 720, 0.8, 5},
                                           Promise{"room_stereo", 2, 346, 260, 0.9, 7},
                                           Promise{"trinocular", 3, 640, 480, 0.7, 5}),
                         [](const auto& preset) { return preset.param.preset; });

TEST(RoomStereo, ComesBackToWhereItBegan) {
  SimulationOptions options;
  options.preset = "room_stereo";
  const Simulation room = makeSimulation(options);
  const Rigid3 T_begin_end =
      room.motion->poseAt(room.start_ns).inverse() * room.motion->poseAt(room.endNs());
  EXPECT_LT(T_begin_end.translation.norm(), 1e-6);
  EXPECT_LT(T_begin_end.rotation.angularDistance(Eigen::Quaterniond::Identity()), 1e-6);
}

}  // namespace
}  // namespace efm
