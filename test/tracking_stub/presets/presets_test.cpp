// SPDX-License-Identifier: BSD-3-Clause
#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <ostream>
#include <stdexcept>
#include <string>

#include "mapping/geometry/trajectory.h"
#include "test/plugin/temporary_folder.h"
#include "test/tracking_stub/scenes/edge_scene.h"
#include "test/tracking_stub/truth/nearest_surface.h"
#include "tracking_stub/presets/presets.h"
#include "tracking_stub/rendering/frame_renderer.h"
#include "tracking_stub/sensor/simulated_rig.h"

namespace efm::test {

/// The z-depths that a camera sees during a simulation.
struct VisibleDepths {
  double nearest = std::numeric_limits<double>::infinity();
  double farthest = 0;
  double sky = 0;  ///< Fraction of the rays that hit nothing.
};

/// Casts the ray of every fifth pixel in x and y at 11 times.
inline VisibleDepths visibleDepths(const Simulation& simulation, const RigCamera& camera) {
  VisibleDepths depths;
  const PixelRays rays(camera.model);
  int cast = 0;
  int missed = 0;
  for (int i = 0; i <= 10; ++i) {
    const std::int64_t t_ns = simulation.start_ns + simulation.duration_ns * i / 10;
    const SceneView view(simulation.scene, simulation.motion->poseAt(t_ns) * camera.T_rig_cam,
                         rays.bounds());
    for (int y = 0; y < rays.height(); y += 5) {
      for (int x = 0; x < rays.width(); x += 5) {
        const ViewHit hit = view.cast(rays(x, y).ray);
        ++cast;
        if (hit.surface < 0) {
          ++missed;
          continue;
        }
        depths.nearest = std::min(depths.nearest, 1 / hit.inverse_depth);
        depths.farthest = std::max(depths.farthest, 1 / hit.inverse_depth);
      }
    }
  }
  depths.sky = static_cast<double>(missed) / cast;
  return depths;
}

}  // namespace efm::test

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

/// Returns the max distance between the pixel of an event and the projection of its source.
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
  if (promise.preset == "desk_stereo") {
    EXPECT_EQ(simulation.duration_ns, 2'000'000'000);
  }
  if (promise.preset == "room_stereo") {  // the motion ends at its first pose
    const Rigid3 T_begin_end = simulation.motion->poseAt(simulation.start_ns).inverse() *
                               simulation.motion->poseAt(simulation.endNs());
    EXPECT_LT(T_begin_end.translation.norm(), 1e-6);
    EXPECT_LT(T_begin_end.rotation.angularDistance(Eigen::Quaterniond::Identity()), 1e-6);
  }
  // Sources project to their pixels within half a pixel plus the motion of a step: first 4 ms.
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
  const Simulation desk = makeSimulation({"desk_stereo"});
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

using ::testing::AllOf;
using ::testing::HasSubstr;

std::string errorOf(const SimulationOptions& options) {
  return messageOf([&] { makeSimulation(options); });
}

TEST(SimulationPreset, AnUnknownNameIsAnErrorThatListsTheKnownOnes) {
  SimulationOptions options;
  options.preset = "attic";
  EXPECT_THAT(errorOf(options),
              AllOf(HasSubstr("preset"), HasSubstr("'attic'"), HasSubstr("desk_stereo")));
}

TEST(SimulationPreset, TheDurationIsCheckedAndUsed) {
  SimulationOptions options;
  for (const double bad : {0.0, -1.0, 601.0, std::nan("")}) {
    options.duration_s = bad;
    EXPECT_THAT(errorOf(options), AllOf(HasSubstr("duration_s"), HasSubstr("0.001 to 600")));
  }
  options.duration_s = 0.25;
  EXPECT_EQ(makeSimulation(options).duration_ns, 250'000'000);
}

using Eigen::Vector3d;

constexpr std::int64_t kStartNs = 5'000'000'000;

/// Returns 2 s at rest, then 10 s straight ahead at 1 m/s. World: z is down, x is forward.
std::vector<StampedPose> walk() {
  Eigen::Matrix3d R_world_cam;
  R_world_cam << 0, 0, 1, 1, 0, 0, 0, 1, 0;
  std::vector<StampedPose> poses;
  for (int i = 0; i <= 1200; ++i) {
    Rigid3 T_world_cam;
    T_world_cam.rotation = Eigen::Quaterniond(R_world_cam);
    T_world_cam.translation = {7 + std::max(0.0, 0.01 * i - 2), 3, -20};
    poses.push_back({kStartNs + i * 10'000'000LL, T_world_cam});
  }
  return poses;
}

SimulationOptions aroundWalk(const std::string& scene = "room") {
  SimulationOptions options;
  options.scene = scene;
  options.poses = walk();
  options.cameras = {test::smallCamera()};
  return options;
}

TEST(TrajectorySimulation, BeginsAtTheStartOfMotionAndLastsFiveSeconds) {
  SimulationOptions options = aroundWalk();
  const Simulation simulation = makeSimulation(options);
  EXPECT_NEAR(static_cast<double>(simulation.start_ns - kStartNs) * 1e-9, 1.75, 0.5);
  EXPECT_EQ(simulation.duration_ns, 5'000'000'000);
  options.start_ns = kStartNs + 4'000'000'000;
  options.duration_s = 0.5;
  const Simulation chosen = makeSimulation(options);
  EXPECT_EQ(chosen.start_ns, options.start_ns);
  EXPECT_EQ(chosen.duration_ns, 500'000'000);
  // The motion follows the trajectory.
  EXPECT_LT((chosen.motion->poseAt(chosen.endNs()).translation - Vector3d(9.5, 3, -20)).norm(),
            1e-6);
}

TEST(TrajectorySimulation, ScenesAreUprightAroundThePath) {
  struct Case {
    const char* scene;
    double floor_m;  // below the camera; 0: not checked
    double min_depth_m, max_depth_m, sky;
  };
  for (const Case& of :
       {Case{"room", 1.2, 0.7, 9, 0}, {"street", 1.6, 2.5, 51, 0.4}, {"poles", 0, 0.8, 5.2, 0}}) {
    SimulationOptions options = aroundWalk(of.scene);
    options.duration_s = 0.5;
    const Simulation simulation = makeSimulation(options);
    // Down is +z, and ahead +x.
    const Vector3d begin = simulation.motion->poseAt(simulation.start_ns).translation;
    const auto floor = castRay(simulation.scene, begin, {0, 0, 1});
    if (of.floor_m > 0) {
      EXPECT_NEAR(floor.value().distance_m, of.floor_m, 1e-6) << of.scene;
    }
    EXPECT_TRUE(castRay(simulation.scene, begin - Vector3d(0, 0, 0.5), {1, 0, 0})) << of.scene;
    const test::VisibleDepths depths = test::visibleDepths(simulation, simulation.rig.cameras[0]);
    EXPECT_GE(depths.nearest, of.min_depth_m) << of.scene;
    EXPECT_LE(depths.farthest, of.max_depth_m) << of.scene;
    EXPECT_LE(depths.sky, of.sky) << of.scene;
  }
}

TEST(TrajectorySimulation, ErrorsNameTheOptionAndItsRange) {
  SimulationOptions options = aroundWalk("attic");
  EXPECT_THAT(errorOf(options), AllOf(HasSubstr("scene"), HasSubstr("'attic'"), HasSubstr("room")));
  options = aroundWalk();
  options.start_ns = kStartNs - 1;
  EXPECT_THAT(errorOf(options), AllOf(HasSubstr("start = 4.999999999"), HasSubstr("17.000000000")));
  options.start_ns = kStartNs + 10'000'000'000;
  options.duration_s = 3;
  EXPECT_THAT(errorOf(options), AllOf(HasSubstr("duration_s = 3"), HasSubstr("2.000000000")));
  options.poses.clear();
  EXPECT_THAT(errorOf(options), HasSubstr("poses = 0: must be at least 2"));
}

}  // namespace

}  // namespace efm
