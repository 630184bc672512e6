// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/keyframes/keyframe_policy.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <optional>
#include <utility>

#include "test/mapping/keyframes/known_recording.h"

namespace efm::baseline_policy_test {
namespace {

using test::KnownRecording;

constexpr std::int64_t kMs = 1'000'000;
constexpr std::int64_t kStart_ns = 1'700'000'000'000'000'000;
constexpr double kDepthGuess_m = 2;

double secondsSinceStart(std::int64_t t_ns) { return 1e-9 * static_cast<double>(t_ns - kStart_ns); }

Rigid3 turned(double angle_rad) {
  return {Eigen::Quaterniond(Eigen::AngleAxisd(angle_rad, Eigen::Vector3d::UnitY())),
          Eigen::Vector3d::Zero()};
}
Rigid3 moved(double x_m) { return {Eigen::Quaterniond::Identity(), {x_m, 0, 0}}; }

/// An event per millisecond for four seconds; a view of 53 degrees.
KnownRecording recordingOf(std::function<std::optional<Rigid3>(std::int64_t)> T_world_ref) {
  KnownRecording recording;
  recording.start_ns = kStart_ns;
  recording.complete_ns = kStart_ns + 4000 * kMs;
  for (int i = 0; i < 4000; ++i) recording.events_ns.push_back(kStart_ns + i * kMs);
  recording.T_world_ref_at = std::move(T_world_ref);
  return recording;
}

KeyframePolicyOptions options(double window_s, double stride_s) {
  KeyframePolicyOptions options;
  options.policy = KeyframePolicyKind::kBaseline;
  options.window_s = window_s;
  options.stride_s = stride_s;
  return options;
}

/// A keyframe at the origin that saw points at one depth all over its image.
KeyframeDepthMap keyframeThatSaw(double depth_m) {
  KeyframeDepthMap keyframe;
  keyframe.view = KnownRecording().image;
  keyframe.map.depth =
      cv::Mat1f(keyframe.view.height, keyframe.view.width, static_cast<float>(depth_m));
  return keyframe;
}

TEST(BaselinePolicy, RotationEndsAWindowOnceTooFewPointsAreInView) {
  KeyframePolicyOptions turning = options(1.0, 0.02);
  const KeyframeDepthMap seen = keyframeThatSaw(2);
  for (const Eigen::Vector3d& rad_s :
       {Eigen::Vector3d(0, 0.5, 0), {0, -0.5, 0}, {0.5, 0, 0}, {-0.5, 0, 0}}) {
    const auto recording = recordingOf([&](std::int64_t t_ns) {
      return Rigid3{rotationBy(rad_s * secondsSinceStart(t_ns)), Eigen::Vector3d::Zero()};
    });
    const bool sideways = rad_s.x() == 0;
    for (const bool by_the_keyframe : {false, true}) {  // or by the guess
      BaselinePolicy policy(turning, kDepthGuess_m);
      if (by_the_keyframe) policy.advance({kStart_ns, kStart_ns, kStart_ns}, &seen);
      const auto window = policy.current(recording);
      ASSERT_TRUE(window);
      // 30 of 100 columns have left after atan(0.495) - atan(0.195) = 0.267 rad, four of the
      // guess's ten after atan(0.495) - atan(0.1485) = 0.312; of 80 rows 24 after 0.222 rad, and
      // four of ten after 0.258. A stride is 0.01. Corners leave a little before.
      const double least =
          by_the_keyframe ? (sideways ? 0.267 : 0.222) : (sideways ? 0.312 : 0.258);
      const double angle = 0.5 * secondsSinceStart(window->t1_ns);
      EXPECT_GT(angle, 0.9 * least) << rad_s.transpose();
      EXPECT_LT(angle, least + 0.011) << rad_s.transpose();
    }
    turning.min_visible_fraction = 0;
    EXPECT_FALSE(BaselinePolicy(turning, kDepthGuess_m).current(recording)) << "it may all go";
    turning.min_visible_fraction = 0.7;
  }
}

TEST(BaselinePolicy, StandingStillAllOfAWideOrATallViewStaysInIt) {
  auto recording = recordingOf([](std::int64_t) { return Rigid3{}; });
  for (const cv::Size size : {cv::Size(200, 40), cv::Size(40, 200)}) {
    recording.image = {size.width, size.height, 100, 100, 0.5 * size.width, 0.5 * size.height};
    KeyframeDepthMap seen;
    seen.view = recording.image;
    seen.map.depth = cv::Mat1f(size, 2.0F);
    for (const bool by_the_keyframe : {false, true}) {  // or by the guess
      BaselinePolicy policy(options(1.0, 0.05), kDepthGuess_m);
      if (by_the_keyframe) policy.advance({kStart_ns, kStart_ns, kStart_ns}, &seen);
      EXPECT_FALSE(policy.current(recording)) << size;
    }
  }
}

TEST(BaselinePolicy, RestAfterARotationMakesOneKeyframeNotOnePerStride) {
  BaselinePolicy policy(options(1.0, 0.05), kDepthGuess_m);
  const KeyframeDepthMap seen = keyframeThatSaw(2);
  policy.advance({kStart_ns, kStart_ns, kStart_ns}, &seen);
  // The camera looks away from these points and is at rest: there is nothing to triangulate.
  const auto recording = recordingOf([](std::int64_t) { return turned(3.1); });
  const auto window = policy.current(recording);
  ASSERT_TRUE(window);
  EXPECT_EQ(window->t1_ns, kStart_ns + 50 * kMs) << "one stride is enough";
  const KeyframeDepthMap saw_nothing = keyframeThatSaw(0);
  policy.advance(*window, &saw_nothing);
  EXPECT_FALSE(policy.current(recording));
  EXPECT_GT(policy.earliestStart(recording), kStart_ns + 2900 * kMs) << "its events are let go";
}

TEST(BaselinePolicy, TheLastWindowGrowsFromTheEndBack) {
  const auto moving =
      recordingOf([](std::int64_t t_ns) { return moved(0.9 * secondsSinceStart(t_ns)); });
  BaselinePolicy policy(options(0.3, 0.05), kDepthGuess_m);
  policy.advance(*policy.current(moving), nullptr);  // [0, 0.25)
  EXPECT_FALSE(policy.last(moving, kStart_ns + 250 * kMs)) << "all events are in a window";
  EXPECT_FALSE(policy.last(moving, kStart_ns + 274 * kMs)) << "less than a tenth would be new";
  EXPECT_TRUE(policy.last(moving, kStart_ns + 276 * kMs));
  // From the first event that is in none: 0.225 m from 0.05 s, 0.18 m from 0.1 s.
  const auto window = policy.last(moving, kStart_ns + 300 * kMs);
  ASSERT_TRUE(window);
  EXPECT_EQ(window->t0_ns, kStart_ns + 50 * kMs);
  EXPECT_EQ(window->t1_ns, kStart_ns + 300 * kMs);
  EXPECT_EQ(policy.earliestLast(moving), kStart_ns - 50 * kMs);
  // At rest from 0.2 s on: 0.18 m in all.
  const auto stops = recordingOf(
      [](std::int64_t t_ns) { return moved(0.9 * std::min(0.2, secondsSinceStart(t_ns))); });
  EXPECT_FALSE(policy.last(stops, kStart_ns + 300 * kMs)) << "never enough";
  KeyframePolicyOptions shorter = options(0.2, 0.05);
  BaselinePolicy impatient(shorter, kDepthGuess_m);
  impatient.advance({kStart_ns, kStart_ns + 250 * kMs, kStart_ns}, nullptr);
  EXPECT_FALSE(impatient.last(moving, kStart_ns + 300 * kMs)) << "not in the longest window";
}

}  // namespace
}  // namespace efm::baseline_policy_test
