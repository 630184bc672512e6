// SPDX-License-Identifier: BSD-3-Clause
#include <gmock/gmock.h>

#include <cmath>
#include <functional>
#include <mutex>
#include <vector>

#include "mapping/geometry/rigid3.h"
#include "mapping/keyframes/keyframe_mapper.h"
#include "mapping/motion/motion_correction.h"
#include "test/mapping/depth/same_image.h"
#include "test/mapping/keyframes/played_recording.h"
#include "test/mapping/keyframes/random_scene.h"
#include "test/mapping/motion/moving_edges.h"

namespace efm::motion_correction_test {
namespace {

TEST(QuasiNewton, FindsTheBottomOfRosenbrocksValley) {
  const auto valley = [](const Eigen::VectorXd& at, Eigen::VectorXd& slope) {
    const double off = at[1] - at[0] * at[0];
    slope.resize(2);
    slope << -2 * (1 - at[0]) - 400 * at[0] * off, 200 * off;
    return (1 - at[0]) * (1 - at[0]) + 100 * off * off;
  };
  QuasiNewtonOptions options;
  options.max_evaluations = 60;  // a wrong Hessian needs hundreds
  options.min_step = 1e-12;
  const Eigen::VectorXd found = minimise(valley, Eigen::Vector2d(-1.2, 1), options);
  EXPECT_NEAR(found[0], 1, 1e-5);
  EXPECT_NEAR(found[1], 1, 1e-5);
}

TEST(QuasiNewton, IsNeverWorseThanItsStartAndKeepsItsBound) {
  for (int most = 1; most <= 12; ++most) {
    int evaluations = 0;
    const auto waves = [&](const Eigen::VectorXd& at, Eigen::VectorXd& slope) {
      ++evaluations;
      slope = 9 * (9 * at.array()).cos().matrix() + 0.2 * at;
      return (9 * at.array()).sin().sum() + 0.1 * at.squaredNorm();
    };
    Eigen::VectorXd unused;
    const Eigen::Vector3d start(0.3, -0.7, 2);
    QuasiNewtonOptions options;
    options.max_evaluations = most;
    const Eigen::VectorXd found = minimise(waves, start, options);
    EXPECT_LE(evaluations, most);
    EXPECT_LE(waves(found, unused), waves(start, unused));
  }
}

TEST(QuasiNewton, StaysOnAFlatFunctionAndGoesOnDownASlope) {
  QuasiNewtonOptions options;
  options.max_evaluations = 10;
  for (const double slope : {0.0, 1.0}) {
    const auto ramp = [&](const Eigen::VectorXd& at, Eigen::VectorXd& gradient) {
      gradient = Eigen::Vector2d(slope, 0);
      return slope * at.x();
    };
    const Eigen::VectorXd found = minimise(ramp, Eigen::Vector2d(3, 4), options);
    EXPECT_EQ(found.y(), 4);
    EXPECT_LE(found.x(), 3 - 0.5 * slope) << "a tenth each time";
  }
}

}  // namespace

// Whole keyframes along corrected motions. test/integration tests the quality of the correction.

namespace {

using test::map;
using test::MovingEdges;
using test::RandomRecording;
using test::same;

KeyframeMapperOptions options(bool correct_motion, int threads = 1) {
  KeyframeMapperOptions options;
  options.planes = {0.7, 5.0, 60, PlaneSpacing::kInverse};
  options.sweep.threads = threads;
  options.motion.correct_motion = correct_motion;
  return options;
}

/// Returns edges with a tracker that has errors of linear and angular velocity.
MovingEdges blurred(int cameras) {
  MovingEdges recording(cameras);
  recording.trajectory = correctedTrajectory(recording.trajectory, MovingEdges::kWindow,
                                             {{0.03, 0, 0}, {0, 0.15, 0.1}});
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

TEST(MotionCorrection, SigmasAreInMetresAndDegreesPerSecond) {
  // Events of edges in both cameras, blurred by up to 4 px by a wrong velocity along one axis.
  const auto blurred_by = [](int axis, float velocity) {
    std::vector<WarpedEvent> events;
    for (int i = 0; i < 400; ++i) {
      const float since = static_cast<float>(i % 20) / 10 - 1;
      WarpedEvent event;
      event.by_velocity.setZero();
      event.by_velocity(0, axis) = 4 * since / velocity;
      event.by_inverse_depth.setZero();
      event.pixel = {10.3F + 12 * static_cast<float>(i / 100) - 4 * since,
                     4.4F + static_cast<float>(i / 20 % 5)};
      events.push_back(event);
    }
    return std::vector<std::vector<WarpedEvent>>{events, events};
  };
  const ContrastSearch search{cv::Size(60, 14), 0.01, {}};
  constexpr float kVelocity = 0.1F;  // m/s and rad/s
  const auto found = [&](double sigma_m_s, double sigma_rad_s, int axis) {
    MotionCorrectionOptions options;
    options.motion_sigma_m_s = sigma_m_s;
    options.motion_sigma_deg_s = sigma_rad_s / kRadiansPerDegree;
    const auto motion = maximizeContrast(blurred_by(axis, kVelocity), search, options);
    return axis < 3 ? motion.linear_m_s[axis] : motion.angular_rad_s[axis - 3];
  };
  EXPECT_NEAR(found(0.1, 0.1, 0), 0.1, 0.02);
  EXPECT_NEAR(found(0.1, 0.1, 4), 0.1, 0.02);
  for (const int axis : {1, 2, 3, 5}) EXPECT_NEAR(found(0.1, 0.1, axis), 0.1, 0.02) << axis;
  // A sigma of 1/1000 of the velocity keeps it near 0, a sigma of 1/20 does not.
  EXPECT_LT(std::abs(found(1e-4, 0.1, 0)), 0.03);
  EXPECT_LT(std::abs(found(0.1, 1e-4, 4)), 0.03);
  EXPECT_GT(found(0.005, 0.1, 0), 0.06);
  EXPECT_GT(found(0.1, 0.005, 4), 0.06);
}

TEST(MotionCorrection, WithoutEventsThatMeetTheCorrectionIsThatOfTheInput) {
  WarpedEvent event;
  event.by_velocity.setOnes();
  event.by_inverse_depth.setOnes();
  event.pixel = {10, 10};
  WarpedEvent other = event;
  other.pixel = {50, 10};
  const ContrastSearch search{cv::Size(60, 20), 0.01, {{1, 2, 3}, {4, 5, 6}}};
  const std::vector<std::vector<WarpedEvent>> none(2);
  for (const auto& events : {none, {{event}, {other}}}) {
    const VelocityCorrection found = maximizeContrast(events, search, {});
    EXPECT_LT((found.linear_m_s - search.current.linear_m_s).norm(), 1e-12);
    EXPECT_LT((found.angular_rad_s - search.current.angular_rad_s).norm(), 1e-12);
  }
}

}  // namespace

}  // namespace efm::motion_correction_test
