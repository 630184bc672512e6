// SPDX-License-Identifier: BSD-3-Clause
// Whole keyframes along corrected motions. How well the correction does: test/integration.
#include "mapping/motion/motion_correction.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <mutex>
#include <vector>

#include "mapping/geometry/angle.h"
#include "mapping/keyframes/keyframe_mapper.h"
#include "test/mapping/depth/same_image.h"
#include "test/mapping/keyframes/random_recording.h"
#include "test/mapping/motion/moving_edges.h"
#include "test/mapping/options/refused_option.h"

namespace efm::motion_correction_test {
namespace {

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

template <typename Recording>
KeyframeDepthMap map(const Recording& recording, const std::vector<int>& cameras,
                     const KeyframeMapperOptions& options, DsiSink* sink = nullptr) {
  KeyframeMapper mapper(recording.rig, cameras, options);
  const auto keyframe =
      mapper.map(Recording::kWindow, recording.spans(), recording.trajectory, sink);
  EXPECT_TRUE(keyframe);
  return keyframe.value_or(KeyframeDepthMap());
}

/// Edges as seen by a tracker that turns and slides.
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

/// Counts how often each plane comes.
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

TEST(MotionCorrection, ABlurredKeyframeBecomesSharper) {
  for (int cameras = 2; cameras <= 3; ++cameras) {
    const MovingEdges recording = blurred(cameras);
    const KeyframeDepthMap before = map(recording, recording.cameras(), options(false));
    const KeyframeDepthMap after = map(recording, recording.cameras(), options(true));
    ASSERT_TRUE(after.motion_correction) << cameras << " cameras";
    EXPECT_FALSE(before.motion_correction);
    EXPECT_GT(after.map.confidence.dot(after.map.confidence),
              1.01 * before.map.confidence.dot(before.map.confidence));
    EXPECT_EQ(before.T_world_ref.translation, after.T_world_ref.translation);
    EXPECT_EQ(before.events, after.events);
  }
}

TEST(MotionCorrection, OneCameraLosesNothing) {
  const MovingEdges recording = blurred(1);
  const cv::Mat1f before = map(recording, {0}, options(false)).map.confidence;
  const cv::Mat1f after = map(recording, {0}, options(true)).map.confidence;
  EXPECT_GE(after.dot(after), before.dot(before));
}

TEST(MotionCorrection, IsTheKeyframeAlongTheCorrectedMotion) {
  MovingEdges recording = blurred(2);
  const KeyframeDepthMap corrected = map(recording, {0, 1}, options(true));
  ASSERT_TRUE(corrected.motion_correction);
  recording.trajectory =
      correctedTrajectory(recording.trajectory, MovingEdges::kWindow, *corrected.motion_correction);
  expectSame(map(recording, {0, 1}, options(false)), corrected);
}

TEST(MotionCorrection, ThreadsChangeNothing) {
  const MovingEdges recording = blurred(2);
  const KeyframeDepthMap one = map(recording, {0, 1}, options(true, 1));
  const KeyframeDepthMap two = map(recording, {0, 1}, options(true, 2));
  ASSERT_TRUE(one.motion_correction && two.motion_correction);
  EXPECT_EQ(one.motion_correction->linear_m_s, two.motion_correction->linear_m_s);
  EXPECT_EQ(one.motion_correction->angular_rad_s, two.motion_correction->angular_rad_s);
  expectSame(one, two);
}

TEST(MotionCorrection, TheSinkSeesTheFinalSweepAlone) {
  const MovingEdges wrong = blurred(2);
  MovingEdges right = wrong;
  PlaneCounter counted;
  const KeyframeDepthMap with_sink = map(wrong, {0, 1}, options(true), &counted);
  EXPECT_THAT(counted.times, ::testing::Each(1));
  expectSame(map(wrong, {0, 1}, options(true)), with_sink);
  ASSERT_TRUE(with_sink.motion_correction);
  right.trajectory =
      correctedTrajectory(wrong.trajectory, MovingEdges::kWindow, *with_sink.motion_correction);
  PlaneCounter expected;
  map(right, {0, 1}, options(false), &expected);
  EXPECT_DOUBLE_EQ(counted.sum, expected.sum);
}

/// Recordings without information about the motion: the keyframe is the uncorrected one, bit for
/// bit.
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

TEST(MotionCorrection, ARigAtRestDoesNoHarm) {
  RandomRecording recording(4, 2, 3000);
  Trajectory rest;
  for (int i = 0; i <= 11; ++i) {
    rest.add({RandomRecording::kStart_ns + i * std::int64_t{10'000'000}, {}});
  }
  recording.trajectory = rest;
  for (const std::vector<int>& cameras : {std::vector<int>{0}, {0, 1}}) {
    const KeyframeDepthMap keyframe = map(recording, cameras, options(true));
    EXPECT_TRUE(cv::checkRange(keyframe.map.depth));
    if (!keyframe.motion_correction) continue;
    EXPECT_TRUE(keyframe.motion_correction->linear_m_s.allFinite());
    EXPECT_TRUE(keyframe.motion_correction->angular_rad_s.allFinite());
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

TEST(MotionCorrection, WithoutEventsTheCorrectionIsThatOfTheInput) {
  ContrastSearch search{cv::Size(20, 10), 0.01, {{1, 2, 3}, {4, 5, 6}}};
  const VelocityCorrection found = maximizeContrast({{}, {}}, search, {});
  EXPECT_EQ(found.linear_m_s, search.current.linear_m_s);
  EXPECT_EQ(found.angular_rad_s, search.current.angular_rad_s);
}

TEST(MotionCorrection, SigmasAreInMetresAndDegreesPerSecond) {
  // Edges that a wrong velocity along one axis blurs by up to 4 px, as both cameras see them.
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
  // A thousandth holds the velocity back, a twentieth does not.
  EXPECT_LT(std::abs(found(1e-4, 0.1, 0)), 0.03);
  EXPECT_LT(std::abs(found(0.1, 1e-4, 4)), 0.03);
  EXPECT_GT(found(0.005, 0.1, 0), 0.06);
  EXPECT_GT(found(0.1, 0.005, 4), 0.06);
}

TEST(MotionCorrection, WhereCamerasDoNotMeetTheCorrectionIsThatOfTheInput) {
  WarpedEvent event;
  event.by_velocity.setOnes();
  event.by_inverse_depth.setOnes();
  event.pixel = {10, 10};
  WarpedEvent other = event;
  other.pixel = {50, 10};
  ContrastSearch search{cv::Size(60, 20), 0.01, {{1, 2, 3}, {4, 5, 6}}};
  const VelocityCorrection found = maximizeContrast({{event}, {other}}, search, {});
  EXPECT_LT((found.linear_m_s - search.current.linear_m_s).norm(), 1e-12);
  EXPECT_LT((found.angular_rad_s - search.current.angular_rad_s).norm(), 1e-12);
}

TEST(MotionCorrection, InvalidOptionsAreNamed) {
  test::expectRefused<MotionCorrectionOptions>("motion_sigma_m_s = 0",
                                               [](auto& o) { o.motion_sigma_m_s = 0; });
  test::expectRefused<MotionCorrectionOptions>("motion_sigma_deg_s = -1",
                                               [](auto& o) { o.motion_sigma_deg_s = -1; });
  test::expectRefused<MotionCorrectionOptions>("motion_rounds = 0",
                                               [](auto& o) { o.motion_rounds = 0; });
  test::expectRefused<MotionCorrectionOptions>("max_events = 10",
                                               [](auto& o) { o.max_events = 10; });
  test::expectRefused<MotionCorrectionOptions>("min_gain = 2", [](auto& o) { o.min_gain = 2; });
  EXPECT_NO_THROW(MotionCorrectionOptions().validate());
}

}  // namespace
}  // namespace efm::motion_correction_test
