// SPDX-License-Identifier: BSD-3-Clause
#include <gmock/gmock.h>

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <mutex>
#include <optional>
#include <vector>

#include "mapping/geometry/rigid3.h"
#include "mapping/keyframes/keyframe_mapper.h"
#include "mapping/motion/motion_correction.h"
#include "mapping/motion/slice_alignment.h"
#include "test/mapping/depth/same_image.h"
#include "test/mapping/keyframes/played_recording.h"
#include "test/mapping/keyframes/random_scene.h"
#include "test/mapping/motion/moving_edges.h"

namespace efm::motion_correction_test {
namespace {

using test::map;
using test::MovingEdges;
using test::RandomRecording;
using test::same;

constexpr std::int64_t kMillisecond = 1'000'000;

TEST(MotionCorrectionKnots, LieInTheWindowWithOneAtTheReference) {
  const struct {
    Window window;
    std::size_t reference;
    std::size_t knots;
  } cases[] = {{{0, 200 * kMillisecond, 100 * kMillisecond}, 10, 21},
               {{0, 205 * kMillisecond, 0}, 0, 22},
               {{0, 95 * kMillisecond, 95 * kMillisecond}, 10, 11},
               {{0, 5 * kMillisecond, 2 * kMillisecond}, 0, 2},
               {{0, 213 * kMillisecond, 213 * kMillisecond / 2}, 11, 23},
               {{50 * kMillisecond, 60 * kMillisecond, 0}, 0, 7},
               {{0, 10 * kMillisecond, 20 * kMillisecond}, 2, 3}};
  for (const auto& c : cases) {
    const MotionCorrection knots = knotsOf(c.window, 0.01);
    EXPECT_EQ(knots.reference, c.reference);
    EXPECT_EQ(knots.knots.size(), c.knots);
    EXPECT_LE(knots.spacing_s, 0.01 * (1 + 1e-9));
    const auto [first_ns, last_ns] =
        std::minmax({c.window.t0_ns, c.window.t1_ns, c.window.t_ref_ns});
    EXPECT_TRUE(timeOfKnot(knots, 0, c.window) <= first_ns + 1 ||
                timeOfKnot(knots, c.knots - 1, c.window) >= last_ns - 1);
    for (std::size_t i = 0; i < c.knots; ++i) {
      EXPECT_TRUE(timeOfKnot(knots, i, c.window) >= first_ns &&
                  timeOfKnot(knots, i, c.window) <= last_ns);
    }
    EXPECT_TRUE(isSame(knots.displacement(0.003), Rigid3{}));
  }
}

TEST(MotionCorrectionKnots, AreInterpolatedAndHeldBeyondTheEnds) {
  MotionCorrection correction;
  correction.spacing_s = 0.1;
  correction.reference = 1;
  correction.knots.assign(3, Vector6d::Zero());
  correction.knots[0] << 1, 2, 3, 0.1, 0, 0;
  correction.knots[2] << 4, 0, 0, 0, 0.2, 0;
  const auto expect = [&](double since_s, const Eigen::Vector3d& shift, double x, double y) {
    const Rigid3 T = correction.displacement(since_s);
    EXPECT_LT((T.translation - shift).norm(), 1e-12) << since_s;
    EXPECT_NEAR(T.rotation.x(), std::sin(x / 2), 1e-12) << since_s;
    EXPECT_NEAR(T.rotation.y(), std::sin(y / 2), 1e-12) << since_s;
  };
  expect(-0.1, {1, 2, 3}, 0.1, 0);
  expect(-0.7, {1, 2, 3}, 0.1, 0);
  expect(-0.025, {0.25, 0.5, 0.75}, 0.025, 0);
  expect(0, {0, 0, 0}, 0, 0);
  expect(0.05, {2, 0, 0}, 0, 0.1);
  expect(9, {4, 0, 0}, 0, 0.2);
  EXPECT_TRUE(isSame(MotionCorrection{}.displacement(0.3), Rigid3{}));
}

/// The corrected motion is the tracker's, moved by the correction, also where a tracker has few
/// poses; a gap stays a gap.
TEST(MotionCorrectionKnots, MoveTheTrajectory) {
  const RandomRecording recording(2, 1, 10);
  const Window window = RandomRecording::kWindow;
  MotionCorrection correction = knotsOf(window, 0.01);
  for (std::size_t i = 0; i < correction.knots.size(); ++i) {
    const double since_s = correction.sinceReference(i);
    correction.knots[i] << 0.05 * since_s, -0.03 * since_s, 0, 0.1 * since_s, 0, since_s * since_s;
  }
  for (const std::size_t every : {1, 8}) {
    Trajectory tracked;
    const auto& poses = recording.trajectory.poses();
    for (std::size_t i = 0; i < poses.size(); i += every) tracked.add(poses[i]);
    tracked.add(poses.back());
    const Trajectory corrected = correctedTrajectory(tracked, window, correction);
    EXPECT_TRUE(
        isSame(corrected.poseAt(window.t_ref_ns).value(), tracked.poseAt(window.t_ref_ns).value()));
    for (std::int64_t t_ns = window.t0_ns; t_ns < window.t1_ns; t_ns += 3 * kMillisecond) {
      const double since_s = 1e-9 * static_cast<double>(t_ns - window.t_ref_ns);
      const Rigid3 expected = tracked.poseAt(t_ns).value() * correction.displacement(since_s);
      const Rigid3 T = corrected.poseAt(t_ns).value();
      // Interpolation of poses differs in second order from that of corrections.
      EXPECT_LT((T.translation - expected.translation).norm(), 1e-5);
      EXPECT_LT((T.rotation.conjugate() * expected.rotation).vec().norm(), 1e-5);
    }
  }
  Trajectory gap(TrajectoryOptions{0.001});
  for (const StampedPose& pose : recording.trajectory.poses()) gap.add(pose);
  gap.add({window.t_ref_ns, gap.poses().front().T_world_rig});
  EXPECT_FALSE(
      correctedTrajectory(gap, window, correction).poseAt(window.t_ref_ns + 2 * kMillisecond));
}

TEST(BlurWatch, IsOnByTheMedianOfThreeAndLooksNowAndThen) {
  BlurWatch watch;
  const auto windowsUntilDue = [&] {
    int windows = 0;
    for (; !watch.isDue(); ++windows) watch.add(std::nullopt);
    return windows;
  };
  EXPECT_FALSE(watch.isOn());
  EXPECT_TRUE(watch.isDue());
  watch.add(2.0);
  EXPECT_TRUE(watch.isOn());
  watch.setLast(0);  // the correction did not help
  EXPECT_FALSE(watch.isOn());
  EXPECT_EQ(windowsUntilDue(), 7);
  watch.add(0.2);
  EXPECT_EQ(windowsUntilDue(), 7);
  watch.add(2.0);
  EXPECT_FALSE(watch.isOn()) << "0, 0.2, 2";
  EXPECT_EQ(windowsUntilDue(), 0) << "it may be on soon";
  watch.add(0.3);
  EXPECT_FALSE(watch.isOn()) << "0.2, 2, 0.3";
  watch.add(0.5);
  watch.add(0.5);
  EXPECT_TRUE(watch.isOn()) << "0.3, 0.5, 0.5";
  watch.add(0.3);
  watch.add(0.3);
  EXPECT_FALSE(watch.isOn()) << "0.5, 0.3, 0.3";
  EXPECT_EQ(windowsUntilDue(), 7);
  for (const double blur_px : {0.7, 0.9}) {
    BlurWatch coarse;
    coarse.add(blur_px, 2);
    EXPECT_EQ(coarse.isOn(), blur_px > 0.8) << "0.4 of pixels that are twice as large";
  }
}

TEST(CentralPart, HasTheEventsAroundTheReferenceTime) {
  std::vector<Event> events;
  for (int i = 0; i < 100; ++i) events.push_back({i * kMillisecond, 0, 0, true});
  const ReferenceView view;
  const DepthPlanes planes;
  const Window window{0, 100 * kMillisecond, 80 * kMillisecond};
  const std::vector<CameraEvents> cameras = {{0, nullptr, nullptr, events}};
  const CentralPart part({window, cameras, view, planes, {}}, 0.5);
  EXPECT_EQ(part.window.t0_ns, 40 * kMillisecond);
  EXPECT_EQ(part.window.t1_ns, 90 * kMillisecond);
  EXPECT_EQ(part.window.t_ref_ns, 80 * kMillisecond);
  ASSERT_EQ(part.cameras.front().events.size(), 50U);
  EXPECT_EQ(part.cameras.front().events[0].t_ns, 40 * kMillisecond);
}

// Whole keyframes along corrected motions. test/integration tests the quality of the correction.

KeyframeMapperOptions options(bool correct_motion, int threads = 1) {
  KeyframeMapperOptions options;
  options.planes = {0.7, 5.0, 60, PlaneSpacing::kInverse};
  options.sweep.threads = threads;
  options.motion.correct_motion =
      correct_motion ? MotionCorrectionUse::kAlways : MotionCorrectionUse::kNever;
  return options;
}

/// Returns edges with a tracker that has errors of position and rotation, as a walk.
MovingEdges blurred(int cameras) {
  MovingEdges recording(cameras);
  MotionCorrection errors = knotsOf(MovingEdges::kWindow, 0.02);
  for (std::size_t i = 0; i < errors.knots.size(); ++i) {
    const double since_s = errors.sinceReference(i);
    errors.knots[i] << 0.06 * since_s, 0, 0, 0, 0.2 * std::sin(30 * since_s) / 30, 0.1 * since_s;
  }
  recording.trajectory = correctedTrajectory(recording.trajectory, MovingEdges::kWindow, errors);
  return recording;
}

void expectSame(const KeyframeDepthMap& a, const KeyframeDepthMap& b) {
  EXPECT_TRUE(same(a.map, b.map));
  EXPECT_EQ(a.events, b.events);
  EXPECT_EQ(a.votes.total(), b.votes.total());
  EXPECT_EQ(a.votes.cast, b.votes.cast);
  EXPECT_EQ(a.max_confidence, b.max_confidence);
  EXPECT_EQ(a.T_world_ref.translation, b.T_world_ref.translation);
  EXPECT_EQ(a.T_world_ref.rotation.coeffs(), b.T_world_ref.rotation.coeffs());
}

/// Counts the calls per plane.
class PlaneCounter : public DsiSink {
 public:
  std::vector<int> times = std::vector<int>(60);
  double sum = 0;
  void addPlane(int plane, const float* values) override {
    const std::lock_guard<std::mutex> lock(mutex_);
    ++times.at(static_cast<std::size_t>(plane));
    sum += values[MovingEdges::kWidth * MovingEdges::kHeight / 2];
  }

 private:
  std::mutex mutex_;
};

/// Slices of 10 ms of edges that move in both cameras. Depths are exact.
struct Slices {
  MovingEdges recording;
  UndistortionTable undistortion{recording.rig.cameras.front().model};
  ReferenceView view = ReferenceView::of(recording.rig.cameras.front().model);
  DepthPlanes planes{{0.7, 5.0, 60, PlaneSpacing::kInverse}};
  std::vector<CameraEvents> cameras;
  cv::Mat1f depth = map(recording, recording.cameras(), options(false)).map.depth;
  MotionCorrectionOptions correction;

  explicit Slices(int count) : recording(count) {
    for (int c = 0; c < count; ++c) {
      const auto camera = static_cast<std::size_t>(c);
      cameras.push_back(
          {c, &recording.rig.cameras[camera], &undistortion, recording.events[camera]});
    }
  }

  WindowInput input() const {
    return {MovingEdges::kWindow, cameras, view, planes,
            recording.trajectory.poseAt(MovingEdges::kWindow.t_ref_ns).value()};
  }
  std::optional<AlignedMotion> align(const Trajectory& tracked) const {
    const WindowInput window = input();
    const SliceAlignment slices(window, tracked, correction);
    return slices.align(depth, slices.none());
  }
};

TEST(SliceAlignment, FindsTheTrueMotionOfTheImage) {
  const Slices slices(2);
  const auto exact = slices.align(slices.recording.trajectory);
  ASSERT_TRUE(exact);
  // Edges lie on whole pixels, up to half a pixel from their true places.
  EXPECT_LT(exact->shift_px, 0.6);
  // A turn about y, as large as 3 pixels at the ends of the window.
  MotionCorrection wrong = knotsOf(MovingEdges::kWindow, 0.01);
  for (std::size_t i = 0; i < wrong.knots.size(); ++i) {
    wrong.knots[i][4] = 0.03 * wrong.sinceReference(i) / 0.1;
  }
  const auto found =
      slices.align(correctedTrajectory(slices.recording.trajectory, MovingEdges::kWindow, wrong));
  ASSERT_TRUE(found);
  EXPECT_NEAR(found->shift_px, 90 * 0.03 / std::sqrt(3.0), 0.5);
  double squares = 0;
  for (std::size_t i = 0; i < wrong.knots.size(); ++i) {
    // What is left moves the image; a shift and a turn about y do this together.
    const Vector6d left = found->correction.knots[i] + wrong.knots[i];
    const double px = MovingEdges::kFocal_px * (left[4] + left[0] / 2);
    squares += px * px / static_cast<double>(wrong.knots.size());
  }
  EXPECT_LT(std::sqrt(squares), 0.6);
  EXPECT_TRUE(found->correction.knots[found->correction.reference].isZero());
}

TEST(SliceAlignment, ExpectsTheErrorsOfTheOptions) {
  Slices slices(2);
  // A tracker that stands still has no errors in proportion to its speed.
  Trajectory still;
  for (const StampedPose& pose : slices.recording.trajectory.poses()) {
    still.add({pose.t_ns, slices.recording.trajectory.poses().front().T_world_rig});
  }
  slices.correction.motion_sigma_m_s = 1e-6;
  slices.correction.motion_sigma_deg_s = 1e-6;
  const auto stays = slices.align(still);
  ASSERT_TRUE(stays);
  EXPECT_LT(stays->shift_px, 0.01);
  slices.correction.motion_sigma_m_s = 10;
  EXPECT_GT(slices.align(still)->shift_px, 1);
}

TEST(SliceAlignment, NeedsPointsAndAPoseAndDoesWithGapsAndWithoutEvents) {
  const Slices slices(2);
  const Trajectory& exact = slices.recording.trajectory;
  Slices empty(2);
  empty.depth.setTo(0);
  EXPECT_FALSE(empty.align(exact));
  EXPECT_FALSE(slices.align(Trajectory()));
  Trajectory gap(TrajectoryOptions{0.006});
  for (const StampedPose& pose : exact.poses()) {
    const std::int64_t since_ns = pose.t_ns - MovingEdges::kStart_ns;
    if (since_ns < 30'000'000 || since_ns > 60'000'000) gap.add(pose);
  }
  const auto over_gap = slices.align(gap);
  ASSERT_TRUE(over_gap);
  for (const Vector6d& knot : over_gap->correction.knots) EXPECT_TRUE(knot.allFinite());
  Slices silent(2);
  for (CameraEvents& camera : silent.cameras) camera.events = {};
  ASSERT_TRUE(silent.align(exact));
  EXPECT_EQ(silent.align(exact)->shift_px, 0) << "nothing but the prior";
}

TEST(EdgesIn, AreHighOnAnEdgeAtEachLevelWhateverItsContrast) {
  CameraModel model{640, 480, 500, 500, 320, 240, DistortionModel::kNone, {}};
  const UndistortionTable undistortion(model);
  const ReferenceView view = ReferenceView::of(model);
  for (const int events_per_pixel : {1, 3}) {
    std::vector<Event> events;
    for (std::uint16_t y = 0; y < 480; ++y) {
      for (int i = 0; i < events_per_pixel; ++i) events.push_back({0, 200, y, true});
    }
    for (const int finest : {0, 1}) {
      const EdgeLevels levels = edgesIn(events, undistortion, view, finest);
      ASSERT_EQ(levels.size(), 3U);
      for (std::size_t level = 0; level < levels.size(); ++level) {
        const cv::Mat1b& edges = levels[level];
        const int halvings = finest + static_cast<int>(level);
        ASSERT_EQ(edges.size(), cv::Size(640 >> halvings, 480 >> halvings));
        const int row = edges.rows / 2;
        const int column = 200 >> halvings;
        EXPECT_GT(edges(row, column), 250) << halvings;
        EXPECT_LT(edges(row, column + 8), 140);
        EXPECT_GE(edges(row, column), edges(row, column + 1));
      }
    }
  }
  EXPECT_TRUE(edgesIn(std::vector<Event>(49), undistortion, view, 0).empty()) << "too few events";
}

TEST(MotionCorrection, ABlurredKeyframeIsMappedAlongTheCorrectedMotionAndBecomesSharper) {
  const auto sharpness = [](const KeyframeDepthMap& keyframe) {
    return keyframe.map.confidence.dot(keyframe.map.confidence);
  };
  for (int cameras = 1; cameras <= 3; ++cameras) {
    MovingEdges recording = blurred(cameras);
    const KeyframeDepthMap before = map(recording, recording.cameras(), options(false));
    PlaneCounter counted;
    const KeyframeDepthMap after = map(recording, recording.cameras(), options(true, 2), &counted);
    EXPECT_THAT(counted.times, ::testing::Each(1)) << "the sink sees the final sweep alone";
    EXPECT_FALSE(before.motion_correction);
    EXPECT_EQ(before.T_world_ref.translation, after.T_world_ref.translation);
    EXPECT_GE(sharpness(after), (cameras > 1 ? 1.01 : 1) * sharpness(before));
    ASSERT_TRUE(after.motion_correction || cameras == 1) << cameras;
    if (!after.motion_correction) continue;
    recording.trajectory =
        correctedTrajectory(recording.trajectory, MovingEdges::kWindow, *after.motion_correction);
    PlaneCounter expected;
    expectSame(map(recording, recording.cameras(), options(false), &expected), after);
    EXPECT_DOUBLE_EQ(counted.sum, expected.sum);
  }
}

TEST(MotionCorrection, FurtherRoundsMakeItSharperAndTheFirstMustGainEnough) {
  const MovingEdges recording = blurred(2);
  KeyframeMapperOptions some = options(true);
  double gain = 1;
  for (const int rounds : {1, 2, 3}) {
    some.motion.motion_rounds = rounds;
    const KeyframeDepthMap found = map(recording, recording.cameras(), some);
    EXPECT_GE(found.sharpness_gain, gain) << rounds;
    gain = found.sharpness_gain;
  }
  for (const double asked : {0.5 * (gain - 1), 2 * (gain - 1)}) {
    some.motion.motion_rounds = 1;
    some.motion.min_gain = asked;
    const KeyframeDepthMap found = map(recording, recording.cameras(), some);
    EXPECT_EQ(found.motion_correction.has_value(), asked < gain - 1);
    EXPECT_EQ(found.sharpness_gain > 1, found.motion_correction.has_value());
  }
}

/// With `auto`, blurred keyframes are those of a correction, and sharp ones those without. A single
/// camera is looked at, but never corrected.
TEST(MotionCorrection, ByAutoIsForBlurredKeyframesOfSeveralCameras) {
  KeyframeMapperOptions watching = options(false);
  watching.motion.correct_motion = MotionCorrectionUse::kAuto;
  for (const int cameras : {1, 2}) {
    for (const bool blurs : {false, true}) {
      const MovingEdges recording = blurs ? blurred(cameras) : MovingEdges(cameras);
      const KeyframeDepthMap found = map(recording, recording.cameras(), watching);
      const bool corrects = blurs && cameras > 1;
      EXPECT_EQ(found.motion_correction.has_value(), corrects);
      expectSame(map(recording, recording.cameras(), options(corrects)), found);
      ASSERT_TRUE(found.blur_px);
      EXPECT_EQ(found.sharpness_gain > 1, corrects);
      if (corrects) {
        EXPECT_GT(*found.blur_px, 0.4);
      }
    }
  }
}

/// If recordings have no information about the motion, the keyframe has the bits of the uncorrected
/// keyframe.
TEST(MotionCorrection, WithoutInformationTheKeyframeStays) {
  struct Case {
    const char* what;
    std::function<void(RandomRecording&)> change;
    std::vector<int> cameras;
  };
  const auto keep = [](std::size_t count) {
    return [count](RandomRecording& recording) {
      for (auto& events : recording.events) events.resize(count);
    };
  };
  const std::vector<Case> cases = {
      {"no events", keep(0), {0, 1}},
      {"one event", keep(1), {0, 1}},
      {"few events", keep(20), {0, 1}},
      {"one camera without events", [](auto& recording) { recording.events[1].clear(); }, {0, 1}},
      {"one pose alone",
       [](auto& recording) {
         Trajectory one;
         one.add({RandomRecording::kWindow.t_ref_ns, {}});
         recording.trajectory = one;
       },
       {0, 1}},
  };
  for (const Case& some : cases) {
    RandomRecording recording(3, 2, 500);
    some.change(recording);
    const KeyframeDepthMap kept = map(recording, some.cameras, options(true));
    EXPECT_FALSE(kept.motion_correction) << some.what;
    expectSame(map(recording, some.cameras, options(false)), kept);
  }
}

TEST(MotionCorrection, ASilentCameraAndASinglePlaneDoNoHarm) {
  MovingEdges recording = blurred(2);
  KeyframeMapperOptions one_plane = options(true);
  one_plane.planes.num_planes = 1;
  EXPECT_TRUE(cv::checkRange(map(recording, {0, 1}, one_plane).map.depth));
  recording.events[1].clear();
  KeyframeMapperOptions excluding = options(true);
  excluding.exclude_silent = true;
  expectSame(map(recording, {0}, options(true)), map(recording, {0, 1}, excluding));
}

}  // namespace

}  // namespace efm::motion_correction_test
