// SPDX-License-Identifier: BSD-3-Clause
#include "tracking_stub/presets/trajectory_simulation.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <stdexcept>

#include "test/plugin/temporary_folder.h"
#include "test/tracking_stub/presets/visible_depths.h"
#include "test/tracking_stub/scenes/edge_scene.h"
#include "test/tracking_stub/truth/nearest_surface.h"
#include "tracking_stub/presets/presets.h"

namespace efm {
namespace {

using Eigen::Vector3d;
using ::testing::AllOf;
using ::testing::HasSubstr;

constexpr std::int64_t kStartNs = 5'000'000'000;

/// 10 s at 1 m/s straight ahead, in a world whose z axis is down and forward is x, after 2 s at
/// rest.
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

Rig smallRig() {
  Rig rig;
  rig.cameras = {test::smallCamera()};
  return rig;
}

std::string errorOf(const TrajectorySimulationOptions& options) {
  return messageOf([&] { makeTrajectorySimulation(options, walk(), smallRig()); });
}

TEST(TrajectorySimulation, BeginsAtTheStartOfMotionAndLastsFiveSeconds) {
  TrajectorySimulationOptions options;
  const Simulation simulation = makeTrajectorySimulation(options, walk(), smallRig());
  EXPECT_NEAR(static_cast<double>(simulation.start_ns - kStartNs) * 1e-9, 1.75, 0.5);
  EXPECT_EQ(simulation.duration_ns, 5'000'000'000);
  options.start_ns = kStartNs + 4'000'000'000;
  options.duration_s = 0.5;
  const Simulation chosen = makeTrajectorySimulation(options, walk(), smallRig());
  EXPECT_EQ(chosen.start_ns, options.start_ns);
  EXPECT_EQ(chosen.duration_ns, 500'000'000);
  // The motion is the trajectory's.
  EXPECT_LT((chosen.motion->poseAt(chosen.endNs()).translation - Vector3d(9.5, 3, -20)).norm(),
            1e-6);
}

TEST(TrajectorySimulation, ScenesAreUprightAroundThePath) {
  struct Case {
    const char* scene;
    double floor_m;  // below the camera; 0: not looked at
    double min_depth_m, max_depth_m, sky;
  };
  for (const Case& of :
       {Case{"room", 1.2, 0.7, 9, 0}, {"street", 1.6, 2.5, 51, 0.4}, {"poles", 0, 0.8, 5.2, 0}}) {
    TrajectorySimulationOptions options;
    options.scene = of.scene;
    options.duration_s = 0.5;
    const Simulation simulation = makeTrajectorySimulation(options, walk(), smallRig());
    // Down is +z, and ahead +x.
    const Vector3d begin = simulation.motion->poseAt(simulation.start_ns).translation;
    const auto floor = castRay(simulation.scene, begin, {0, 0, 1});
    if (of.floor_m > 0) EXPECT_NEAR(floor.value().distance_m, of.floor_m, 1e-6) << of.scene;
    EXPECT_TRUE(castRay(simulation.scene, begin - Vector3d(0, 0, 0.5), {1, 0, 0})) << of.scene;
    const test::VisibleDepths depths = test::visibleDepths(simulation, simulation.rig.cameras[0]);
    EXPECT_GE(depths.nearest, of.min_depth_m) << of.scene;
    EXPECT_LE(depths.farthest, of.max_depth_m) << of.scene;
    EXPECT_LE(depths.sky, of.sky) << of.scene;
  }
}

TEST(TrajectorySimulation, ErrorsNameTheOptionAndItsRange) {
  TrajectorySimulationOptions options;
  options.scene = "attic";
  EXPECT_THAT(errorOf(options), AllOf(HasSubstr("scene"), HasSubstr("'attic'"), HasSubstr("room")));
  options = {};
  options.start_ns = kStartNs - 1;
  EXPECT_THAT(errorOf(options), AllOf(HasSubstr("start = 4.999999999"), HasSubstr("17.000000000")));
  options.start_ns = kStartNs + 10'000'000'000;
  options.duration_s = 3;
  EXPECT_THAT(errorOf(options), AllOf(HasSubstr("duration_s = 3"), HasSubstr("2.000000000")));
  EXPECT_THROW(makeTrajectorySimulation({}, {}, smallRig()), std::invalid_argument);
}

}  // namespace
}  // namespace efm
