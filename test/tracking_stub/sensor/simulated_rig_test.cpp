// SPDX-License-Identifier: BSD-3-Clause
#include "tracking_stub/sensor/simulated_rig.h"

#include <gtest/gtest.h>

#include <functional>

#include <algorithm>
#include <cmath>
#include <map>
#include <stdexcept>

#include "test/tracking_stub/scenes/edge_scene.h"
#include "tracking_stub/presets/presets.h"

namespace efm {
namespace {

constexpr double kSpeed = 0.3;     // m/s, to the right
constexpr double kDepth = 1.0;     // metres
constexpr float kContrast = 1.0F;  // log intensity
constexpr double kThreshold = 0.15;

/// A camera moves to the right past an upright edge at x = 0: in the image the edge moves to the
/// left at f v / z = 15 pixels per second, through cx at t = 0.
Simulation passingEdge() {
  Simulation simulation;
  simulation.scene.addRectangle(test::facingWall(kDepth, 4, 4),
                                test::edgePaint(2.0, kContrast, 0.01));
  simulation.rig.cameras = {test::smallCamera()};
  simulation.motion = std::make_shared<test::StraightMotion>(Eigen::Vector3d(kSpeed, 0, 0));
  simulation.start_ns = -1'000'000'000;
  simulation.duration_ns = 2'000'000'000;
  simulation.pixels.threshold_on = simulation.pixels.threshold_off = kThreshold;
  simulation.max_step_px = 0.1;
  return simulation;
}

TEST(SimulatedRig, AMovingEdgeFiresAtItsPositionAndTime) {
  const Simulation simulation = passingEdge();
  const auto recordings = simulateEvents(simulation);
  ASSERT_EQ(recordings.size(), 1U);
  const CameraModel& model = simulation.rig.cameras[0].model;
  ASSERT_GT(recordings[0].events.size(), 1000U);
  const std::vector<Event>& events = recordings[0].events;
  EXPECT_TRUE(std::is_sorted(events.begin(), events.end(), [](const Event& a, const Event& b) {
    return std::tie(a.t_ns, a.y, a.x) < std::tie(b.t_ns, b.y, b.x);
  }));
  EXPECT_GE(events.front().t_ns, simulation.start_ns);
  EXPECT_LE(events.back().t_ns, simulation.endNs());
  double sum_px = 0;
  for (const Event& event : events) {
    const double edge_x =
        model.cx - model.fx * kSpeed / kDepth * (static_cast<double>(event.t_ns) * 1e-9);
    // With a blur of half a pixel, the edge has an effect up to two pixels away.
    EXPECT_NEAR(event.x, edge_x, 2.5);
    EXPECT_TRUE(event.polarity);  // the bright side enters
    sum_px += event.x - edge_x;
  }
  // The mean is the edge, except for the lag of a threshold.
  EXPECT_NEAR(sum_px / static_cast<double>(recordings[0].events.size()), 0, 0.1);
}

TEST(SimulatedRig, EveryPixelOnThePathOfTheEdgeFiresContrastOverThreshold) {
  const Simulation simulation = passingEdge();
  std::map<int, int> per_column;
  const auto recordings = simulateEvents(simulation);
  for (const Event& event : recordings[0].events) ++per_column[event.x];
  // From t = -1 s to 1 s the edge passes the columns 46.5 to 16.5. Well within them each pixel sees
  // the whole contrast. The remainder below a threshold fires no event. Its mean is half a
  // threshold, because the memory at the start is random.
  for (int x = 20; x <= 43; ++x) {
    const double mean = per_column[x] / 48.0;
    EXPECT_NEAR(mean, kContrast / kThreshold - 0.5, 0.35) << "column " << x;
  }
  EXPECT_EQ(per_column.count(10), 0U);
  EXPECT_EQ(per_column.count(55), 0U);
}

TEST(SimulatedRig, ASilhouetteBelongsToTheSurfaceInFrontAndIsPreciseToAPixel) {
  Simulation simulation = passingEdge();
  simulation.scene = Scene();
  simulation.scene.addRectangle(test::facingWall(3, 20, 20), test::evenPaint(0));
  // A much brighter card 1 m away. Its left border is at x = 0.
  simulation.scene.addRectangle({{0, 1, 1}, {1, 0, 0}, {0, -1, 0}, 2, 2},
                                test::evenPaint(kContrast));
  const auto recording = simulateEvents(simulation)[0];
  const CameraModel& model = simulation.rig.cameras[0].model;
  ASSERT_GT(recording.events.size(), 1000U);
  for (std::size_t i = 0; i < recording.events.size(); ++i) {
    const Event& event = recording.events[i];
    const Rigid3 T_world_cam = simulation.motion->poseAt(event.t_ns);
    const Eigen::Vector3d border_world(0, 0, 1);
    EXPECT_NEAR(event.x, model.project(T_world_cam.inverse() * border_world).x(), 0.6);
    EXPECT_EQ(recording.sources[i].surface, 1);
  }
}

TEST(SimulatedRig, TheSameSeedGivesTheSameEventsWithAnyNumberOfThreads) {
  SimulationOptions options;
  options.duration_s = 0.005;
  Simulation desk = makeSimulation(options);
  desk.pixels.mismatch = 0.05;
  desk.pixels.refractory_ns = 500'000;
  desk.noise.background_hz = 2;
  std::vector<std::vector<Event>> events;
  for (const int threads : {1, 2, 3}) {
    SimulationRun run;
    run.threads = threads;
    events.push_back(simulateEvents(desk, run)[1].events);
  }
  ASSERT_GT(events[0].size(), 200U);
  EXPECT_EQ(events[0], events[1]);
  EXPECT_EQ(events[0], events[2]);
  desk.seed = 2;
  EXPECT_NE(simulateEvents(desk)[1].events, events[0]);
}

TEST(SimulatedRig, NoiseIsAddedAndHasNoSource) {
  Simulation simulation = passingEdge();
  const auto ideal = simulateEvents(simulation)[0];
  simulation.noise.background_hz = 1;
  const auto noisy = simulateEvents(simulation)[0];
  std::vector<Event> without;
  for (std::size_t i = 0; i < noisy.events.size(); ++i) {
    if (noisy.sources[i].surface >= 0) without.push_back(noisy.events[i]);
  }
  EXPECT_EQ(without, ideal.events);
  const double expected = 64 * 48 * 2;  // pixels and seconds
  EXPECT_NEAR(static_cast<double>(noisy.events.size() - without.size()), expected,
              5 * std::sqrt(expected));
}

TEST(SimulatedRig, AnEdgeFiresOnItsDistortedImage) {
  for (const DistortionModel distortion :
       {DistortionModel::kRadtan, DistortionModel::kEquidistant}) {
    Simulation simulation = passingEdge();
    RigCamera& camera = simulation.rig.cameras[0];
    camera.model.distortion = distortion;
    camera.model.coefficients = distortion == DistortionModel::kRadtan
                                    ? std::vector<double>{-0.3, 0.1, 0.002, -0.003}
                                    : std::vector<double>{-0.05, 0.01, -0.02, 0.005};
    // A rotated camera, not at the origin of the rig.
    camera.T_rig_cam.rotation = Eigen::AngleAxisd(1.2, Eigen::Vector3d::UnitZ()) *
                                Eigen::AngleAxisd(0.1, Eigen::Vector3d::UnitX());
    camera.T_rig_cam.translation = {0.05, -0.1, 0.02};
    const auto recording = simulateEvents(simulation)[0];
    ASSERT_GT(recording.events.size(), 1000U);
    double sum_px = 0;
    std::size_t compared = 0;
    for (std::size_t i = 0; i < recording.events.size(); i += 7, ++compared) {
      const Event& event = recording.events[i];
      // The nearest point of the edge x = 0, z = 1 in the image.
      const Rigid3 T_cam_world =
          (simulation.motion->poseAt(event.t_ns) * camera.T_rig_cam).inverse();
      double nearest_px = 1e9;
      for (double y = -2; y <= 2; y += 0.01) {
        const Eigen::Vector3d p_cam = T_cam_world * Eigen::Vector3d(0, y, kDepth);
        if (p_cam.z() < 0.2 || p_cam.hnormalized().norm() > 1.5) continue;
        nearest_px = std::min(
            nearest_px, (camera.model.project(p_cam) - Eigen::Vector2d(event.x, event.y)).norm());
      }
      // The blur has an effect two pixels away, and more where a pixel starts close to its
      // threshold.
      ASSERT_LT(nearest_px, 5);
      sum_px += nearest_px;
    }
    EXPECT_LT(sum_px / static_cast<double>(compared), 0.8);
  }
}

TEST(SimulatedRig, ReportsItsProgressToTheEnd) {
  SimulationRun run;
  std::vector<double> fractions;
  run.progress = [&fractions](double fraction) { fractions.push_back(fraction); };
  simulateEvents(passingEdge(), run);
  EXPECT_TRUE(std::is_sorted(fractions.begin(), fractions.end()));
  EXPECT_DOUBLE_EQ(fractions.back(), 1);
}

TEST(SimulatedRig, RefusesInvalidSimulations) {
  const std::function<void(Simulation&)> mistakes[] = {
      [](Simulation& s) { s.rig.cameras[0].time_offset_ns = 5; },
      [](Simulation& s) { s.motion = nullptr; }, [](Simulation& s) { s.duration_ns = 0; }};
  for (const auto& makeMistake : mistakes) {
    Simulation simulation = passingEdge();
    makeMistake(simulation);
    EXPECT_THROW(simulateEvents(simulation), std::invalid_argument);
  }
  SimulationRun run;
  run.threads = 0;
  EXPECT_THROW(simulateEvents(passingEdge(), run), std::invalid_argument);
}

TEST(SimulatedRig, PosesAreSampledFromStartToEnd) {
  Simulation simulation = passingEdge();
  simulation.duration_ns = 10'500'000;
  const auto poses = samplePoses(simulation);
  ASSERT_EQ(poses.size(), 12U);
  EXPECT_EQ(poses.front().t_ns, simulation.start_ns);
  EXPECT_EQ(poses.back().t_ns, simulation.endNs());
}

}  // namespace
}  // namespace efm
