// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <stdexcept>

#include "test/tracking_stub/scenes/edge_scene.h"
#include "tracking_stub/presets/presets.h"
#include "tracking_stub/sensor/simulated_rig.h"

namespace efm {
namespace {

constexpr std::int64_t kSecondNs = 1'000'000'000;

std::vector<Event> fireAll(EventNoise& noise, int height, std::int64_t until_ns) {
  std::vector<Event> events;
  for (int y = 0; y < height; ++y) noise.fireRow(y, until_ns, events);
  return events;
}

TEST(EventNoise, EveryPixelFiresAtTheBackgroundRateWithHalfOfEachPolarity) {
  EventNoiseOptions options;
  options.background_hz = 5;
  EventNoise noise(40, 30, options, {1, kSecondNs});
  const auto events = fireAll(noise, 30, 3 * kSecondNs);
  // 12000 events are expected. The stddev of a Poisson number is its root, 110.
  EXPECT_NEAR(static_cast<double>(events.size()), 12'000, 450);
  int on = 0;
  std::map<std::pair<int, int>, int> per_pixel;
  for (const Event& event : events) {
    on += event.polarity ? 1 : 0;
    ++per_pixel[{event.x, event.y}];
    EXPECT_GE(event.t_ns, kSecondNs);
    EXPECT_LE(event.t_ns, 3 * kSecondNs);
    EXPECT_EQ(event.t_ns % 1000, 0);
  }
  EXPECT_NEAR(on, 6'000, 250);
  // The variance of a Poisson number is its mean: 10.
  double squares = 0;
  for (const auto& [pixel, count] : per_pixel) squares += (count - 10.0) * (count - 10.0);
  EXPECT_NEAR(squares / 1200, 10, 1.7);
}

TEST(EventNoise, AFixedFractionOfThePixelsIsHot) {
  EventNoiseOptions options;
  options.hot_fraction = 0.05;
  options.hot_hz = 200;
  EventNoise noise(100, 80, options, {1, 0});
  std::map<std::pair<int, int>, int> per_pixel;
  for (const Event& event : fireAll(noise, 80, kSecondNs)) ++per_pixel[{event.x, event.y}];
  EXPECT_NEAR(static_cast<double>(per_pixel.size()), 400, 80);
  for (const auto& [pixel, count] : per_pixel) EXPECT_NEAR(count, 200, 75);
}

TEST(EventNoise, DoesNotDependOnTheTimesOfTheCalls) {
  EventNoiseOptions options;
  options.background_hz = 300;
  EventNoise at_once(1, 1, options, {7, 0});
  EventNoise in_steps(1, 1, options, {7, 0});
  EventNoise other_seed(1, 1, options, {8, 0});
  const auto whole = fireAll(at_once, 1, kSecondNs);
  std::vector<Event> parts;
  for (std::int64_t t_ns = 1'234'567; t_ns < kSecondNs; t_ns += 1'234'567) {
    const std::size_t before = parts.size();
    in_steps.fireRow(0, t_ns, parts);
    for (std::size_t i = before; i < parts.size(); ++i) EXPECT_LE(parts[i].t_ns, t_ns);
  }
  in_steps.fireRow(0, kSecondNs, parts);
  ASSERT_GT(whole.size(), 200U);
  EXPECT_EQ(parts, whole);
  EXPECT_NE(fireAll(other_seed, 1, kSecondNs), whole);
}

class OnePixel : public ::testing::Test {
 protected:
  OnePixel() : pixels(1, 1, EventPixelOptions{0.2, 0.2}) { pixels.start(level(1.0F)); }
  static cv::Mat1f level(float log_intensity) { return cv::Mat1f(1, 1, log_intensity); }
  std::vector<Event> step(const FrameStep& step, float from, float to) {
    std::vector<Event> events;
    pixels.fireRow(0, step, level(from), level(to), events);
    return events;
  }
  EventPixels pixels;
};

TEST_F(OnePixel, FiresAtTheTimeWhenTheThresholdIsCrossed) {
  // From 1.0 to 1.5 in 10 ms: 1.2 is crossed after 4 ms, 1.4 after 8 ms.
  const auto events = step({0, 10'000'000}, 1.0F, 1.5F);
  ASSERT_EQ(events.size(), 2U);
  EXPECT_EQ(events[0], (Event{4'000'000, 0, 0, true}));
  EXPECT_EQ(events[1], (Event{8'000'000, 0, 0, true}));
}

TEST_F(OnePixel, RemembersItsLastEventAcrossSteps) {
  EXPECT_TRUE(step({0, 10'000'000}, 1.0F, 1.15F).empty());
  // The step from 1.15 to 1.35 crosses 1.2 after a quarter of its time.
  const auto brighter = step({10'000'000, 20'000'000}, 1.15F, 1.35F);
  ASSERT_EQ(brighter.size(), 1U);
  EXPECT_EQ(brighter[0].t_ns, 12'500'000);
  // One threshold below 1.2 is 1.0: the step reaches it at the very end.
  const auto darker = step({20'000'000, 30'000'000}, 1.35F, 0.999F);
  ASSERT_EQ(darker.size(), 1U);
  EXPECT_FALSE(darker[0].polarity);
  EXPECT_NEAR(static_cast<double>(darker[0].t_ns), 30'000'000, 50'000);
}

TEST_F(OnePixel, FiresAtOnceWhenItStartsAThresholdAwayWithoutAChange) {
  EventPixels running(1, 1, EventPixelOptions{0.2, 0.2});
  running.start(level(1.0F));
  std::vector<Event> events;
  running.fireRow(0, {5'000, 10'000}, level(1.5F), level(1.5F), events);
  ASSERT_EQ(events.size(), 2U);
  EXPECT_EQ(events[0].t_ns, 5'000);
  EXPECT_EQ(events[1].t_ns, 5'000);
}

TEST_F(OnePixel, StampsWholeMicrosecondsAlsoOfALargeClock) {
  const std::int64_t t0_ns = 1'700'000'000'123'456'789;
  for (const Event& event : step({t0_ns, t0_ns + 777'777}, 1.0F, 3.0F)) {
    EXPECT_EQ(event.t_ns % 1000, 0);
    EXPECT_GE(event.t_ns, t0_ns - 500);
    EXPECT_LE(event.t_ns, t0_ns + 777'777 + 500);
  }
}

std::vector<Event> fireAll(EventPixels& pixels, const cv::Mat1f& from, const cv::Mat1f& to) {
  std::vector<Event> events;
  for (int y = 0; y < from.rows; ++y) pixels.fireRow(y, {0, 1'000'000}, from, to, events);
  return events;
}

TEST(EventPixels, StartWithinTheirThresholdsOfTheCurrentIntensity) {
  struct Row {
    EventPixelOptions thresholds;
    float change;
    double fired, tolerance;  // of 3600 pixels
  };
  // A change by half a threshold fires a quarter of the pixels. With thresholds of 0.1 and 0.4,
  // half of the pixels wait for 0 to 0.1: a change by 0.05 fires a quarter, too.
  for (const Row& row : {Row{{0.2, 0.2}, 0.1F, 900, 100}, Row{{0.1, 0.4}, 0.05F, 900, 100}}) {
    const cv::Mat1f seen(60, 60, 3.0F);
    EventPixels pixels(60, 60, row.thresholds);
    pixels.start(seen, 5);
    EXPECT_TRUE(fireAll(pixels, seen, seen).empty());
    const auto fired = fireAll(pixels, seen, cv::Mat1f(60, 60, 3.0F + row.change));
    EXPECT_NEAR(static_cast<double>(fired.size()), row.fired, row.tolerance);
  }
}

TEST(EventPixels, HaveAThresholdEachForBrighterAndDarker) {
  EventPixels pixels(1, 1, EventPixelOptions{0.1, 0.25});
  const cv::Mat1f low(1, 1, 0.0F);
  const cv::Mat1f high(1, 1, 1.01F);
  pixels.start(low);
  std::vector<Event> up;
  std::vector<Event> down;
  pixels.fireRow(0, {0, 1'000'000}, low, high, up);
  pixels.fireRow(0, {1'000'000, 2'000'000}, high, low, down);
  EXPECT_EQ(up.size(), 10U);
  EXPECT_EQ(down.size(), 4U);
}

TEST(EventPixels, MismatchScattersThresholdsFromPixelToPixel) {
  EventPixelOptions options{0.1, 0.1};
  options.mismatch = 0.1;
  const cv::Mat1f low(60, 60, 0.0F);
  const cv::Mat1f high(60, 60, 10.0F);
  const auto counts_of = [&](std::uint64_t seed) {
    EventPixels pixels(60, 60, options, seed);
    pixels.start(low);
    std::vector<double> counts(3600, 0.0);
    for (const Event& event : fireAll(pixels, low, high))
      ++counts[static_cast<std::size_t>(event.y * 60 + event.x)];
    return counts;
  };
  // A pixel fires 10 / threshold times. Its threshold is 10 / count with an error of 1 %.
  double sum = 0;
  double squares = 0;
  for (const double count : counts_of(3)) {
    sum += 10 / count;
    squares += 100 / count / count;
  }
  EXPECT_NEAR(sum / 3600, 0.1, 0.001);
  EXPECT_NEAR(std::sqrt(squares / 3600 - sum * sum / 3600 / 3600), 0.01, 0.0005);
  EXPECT_EQ(counts_of(3), counts_of(3));
  EXPECT_NE(counts_of(3), counts_of(4));
}

TEST(EventPixels, AreBlindForTheRefractoryPeriodAndThenRememberTheCurrentIntensity) {
  EventPixelOptions options{0.2, 0.2};
  options.refractory_ns = 3'000'000;
  EventPixels pixels(1, 1, options);
  // The change is 0.1 per millisecond. 0.2 is crossed at 2 ms, and the pixel is blind until 5 ms.
  // From 0.5 it crosses 0.7 at 7 ms and is blind until 10 ms. From 1.0 it crosses 1.2 at 12 ms.
  const auto at = [](float value) { return cv::Mat1f(1, 1, value); };
  pixels.start(at(0));
  std::vector<Event> events;
  pixels.fireRow(0, {0, 4'000'000}, at(0), at(0.4F), events);
  pixels.fireRow(0, {4'000'000, 10'000'000}, at(0.4F), at(1), events);
  pixels.fireRow(0, {10'000'000, 14'000'000}, at(1), at(1.4F), events);
  ASSERT_EQ(events.size(), 3U);
  EXPECT_NEAR(static_cast<double>(events[0].t_ns), 2'000'000, 1'000);
  EXPECT_NEAR(static_cast<double>(events[1].t_ns), 7'000'000, 1'000);
  EXPECT_NEAR(static_cast<double>(events[2].t_ns), 12'000'000, 2'000);
}

constexpr double kSpeed = 0.3;     // m/s, to the right
constexpr double kDepth = 1.0;     // metres
constexpr float kContrast = 1.0F;  // log intensity
constexpr double kThreshold = 0.15;

/// Returns a camera that moves to the right past an upright edge at x = 0. In the image the edge
/// moves to the left at f v / z = 15 pixels per second and is at cx at t = 0.
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
    // The edge has an effect up to two pixels away, because of a blur of half a pixel.
    EXPECT_NEAR(event.x, edge_x, 2.5);
    EXPECT_TRUE(event.polarity);  // the bright side enters the pixel
    sum_px += event.x - edge_x;
  }
  // The mean position is the edge, except for the lag of a threshold.
  EXPECT_NEAR(sum_px / static_cast<double>(recordings[0].events.size()), 0, 0.1);
}

TEST(SimulatedRig, EveryPixelOnThePathOfTheEdgeFiresContrastOverThreshold) {
  const Simulation simulation = passingEdge();
  std::map<int, int> per_column;
  const auto recordings = simulateEvents(simulation);
  for (const Event& event : recordings[0].events) ++per_column[event.x];
  // From t = -1 s to 1 s the edge passes the columns 46.5 to 16.5. Pixels well inside these columns
  // see the whole contrast. The remainder below a threshold fires no event. Its mean is half a
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
      // The blur has an effect two pixels away, and farther if a pixel starts close to its
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

TEST(SimulatedRig, RejectsInvalidSimulations) {
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
