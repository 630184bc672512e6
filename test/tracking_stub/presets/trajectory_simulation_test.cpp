// SPDX-License-Identifier: BSD-3-Clause
#include "tracking_stub/presets/trajectory_simulation.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <limits>
#include <stdexcept>

#include "test/paths.h"
#include "test/plugin/message_of.h"
#include "test/tracking_stub/presets/visible_depths.h"
#include "test/tracking_stub/scenes/edge_scene.h"
#include "test/tracking_stub/scenes/ray_cast.h"
#include "tracking_stub/poses/tum_trajectory.h"
#include "tracking_stub/presets/preset_rigs.h"

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

test::VisibleDepths depthsOf(const Simulation& simulation) {
  return test::visibleDepths(simulation, simulation.rig.cameras[0]);
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

TEST(TrajectorySimulation, ARoomContainsThePathAndIsUprightForTheCameras) {
  const Simulation simulation = makeTrajectorySimulation({}, walk(), smallRig());
  // Down is +z: the floor is 1.2 m below, the ceiling above.
  const Vector3d middle =
      simulation.motion->poseAt(simulation.start_ns + 1'000'000'000).translation;
  const auto floor = castRay(simulation.scene, middle, {0, 0, 1});
  ASSERT_TRUE(floor.has_value());
  EXPECT_NEAR(floor->distance_m, 1.2, 1e-6);
  EXPECT_TRUE(castRay(simulation.scene, middle, {0, 0, -1}).has_value());
  const test::VisibleDepths depths = depthsOf(simulation);
  EXPECT_GE(depths.nearest, 0.7);
  EXPECT_LE(depths.farthest, 9);
  EXPECT_EQ(depths.sky, 0);
}

TEST(TrajectorySimulation, AStreetFollowsThePath) {
  TrajectorySimulationOptions options;
  options.scene = "street";
  const Simulation simulation = makeTrajectorySimulation(options, walk(), smallRig());
  const Vector3d begin = simulation.motion->poseAt(simulation.start_ns).translation;
  const auto road = castRay(simulation.scene, begin, {0, 0, 1});
  ASSERT_TRUE(road.has_value());
  EXPECT_NEAR(road->distance_m, 1.6, 1e-6);
  const auto end = castRay(simulation.scene, begin - Vector3d(0, 0, 0.5), {1, 0, 0});
  ASSERT_TRUE(end.has_value());
  EXPECT_NEAR(end->distance_m, 50, 0.5);
  const test::VisibleDepths depths = depthsOf(simulation);
  EXPECT_GE(depths.nearest, 2.5);
  EXPECT_LE(depths.farthest, 51);
  EXPECT_LT(depths.sky, 0.4);
}

TEST(TrajectorySimulation, PolesStandBeforeTheCamera) {
  TrajectorySimulationOptions options;
  options.scene = "poles";
  options.duration_s = 0.5;
  const test::VisibleDepths depths =
      depthsOf(makeTrajectorySimulation(options, walk(), smallRig()));
  EXPECT_GE(depths.nearest, 0.8);
  EXPECT_LE(depths.farthest, 5.2);
  EXPECT_EQ(depths.sky, 0);
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

/// A measured trajectory, its scene, and the max speed and acceleration of such carriers.
struct Measured {
  const char* file;
  const char* scene;
  double max_speed;         // m/s
  double max_acceleration;  // m/s2
};

class MeasuredTrajectory : public ::testing::TestWithParam<Measured> {};

TEST_P(MeasuredTrajectory, BecomesAMotionAsSmoothAsItsCarrier) {
  const std::filesystem::path file =
      std::filesystem::path(EFM_SHARED_DATA) / "trajectories" / GetParam().file;
  if (!std::filesystem::exists(file)) GTEST_SKIP() << file << " is not there";
  TrajectorySimulationOptions options;
  options.scene = GetParam().scene;
  const Simulation simulation =
      makeTrajectorySimulation(options, readTumTrajectory(file), smallRig());
  EXPECT_EQ(simulation.duration_ns, 5'000'000'000);
  constexpr std::int64_t kStepNs = 5'000'000;
  const auto at = [&](std::int64_t t_ns) { return simulation.motion->poseAt(t_ns).translation; };
  double length = 0;
  for (std::int64_t t_ns = simulation.start_ns + kStepNs; t_ns + kStepNs < simulation.endNs();
       t_ns += kStepNs) {
    const Vector3d step = at(t_ns + kStepNs) - at(t_ns);
    const Vector3d before = at(t_ns) - at(t_ns - kStepNs);
    EXPECT_LT(step.norm() / 0.005, GetParam().max_speed);
    EXPECT_LT((step - before).norm() / (0.005 * 0.005), GetParam().max_acceleration);
    length += step.norm();
  }
  EXPECT_GT(length, 0.5);
  const test::VisibleDepths depths = depthsOf(simulation);
  EXPECT_GE(depths.nearest, 0.5);
  EXPECT_LT(depths.sky, 0.4);
}

INSTANTIATE_TEST_SUITE_P(Shared, MeasuredTrajectory,
                         ::testing::Values(Measured{"mvsec_indoor_flying1.txt", "room", 1.5, 30},
                                           Measured{"dsec_zurich_city_04.txt", "street", 8, 10},
                                           Measured{"rpg_eccv18_desk.txt", "room", 0.8, 12},
                                           Measured{"tumvie_desk2.txt", "room", 0.8, 12}),
                         [](const auto& recording) {
                           const std::string file = recording.param.file;
                           return file.substr(0, file.find('.'));
                         });

}  // namespace
}  // namespace efm
