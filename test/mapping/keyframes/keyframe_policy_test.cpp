// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <optional>
#include <stdexcept>
#include <utility>
#include <vector>

#include "mapping/geometry/timestamp.h"
#include "mapping/keyframes/keyframe_policy.h"

namespace efm::test {

/// A recording of one camera that is complete until `complete_ns`.
class KnownRecording : public RecordingProgress {
 public:
  std::int64_t start_ns = 0;
  std::int64_t complete_ns = kEndOfTimeNs;
  std::vector<std::int64_t> events_ns;  // in order
  std::function<std::optional<Rigid3>(std::int64_t)> T_world_ref_at;
  ReferenceView image{100, 80, 100, 100, 49.5, 39.5};

  std::int64_t startNs() const override { return start_ns; }
  std::int64_t reachedNs() const override { return complete_ns; }
  std::int64_t completeNs() const override { return complete_ns; }
  std::optional<std::int64_t> timeOfEvent(std::int64_t from_ns, std::int64_t count) const override {
    auto event = std::lower_bound(events_ns.begin(), events_ns.end(), from_ns);
    if (events_ns.end() - event < count) return std::nullopt;
    event += count - 1;
    return *event < complete_ns ? std::optional(*event) : std::nullopt;
  }
  std::int64_t eventsIn(std::int64_t t0_ns, std::int64_t t1_ns) const override {
    const auto first = std::lower_bound(events_ns.begin(), events_ns.end(), t0_ns);
    return std::lower_bound(first, events_ns.end(), t1_ns) - first;
  }
  std::optional<Rigid3> viewPoseAt(std::int64_t t_ns) const override {
    return T_world_ref_at(t_ns);
  }
  const ReferenceView& view() const override { return image; }
};

}  // namespace efm::test

namespace efm::keyframe_policy_test {
namespace {

constexpr std::int64_t kStart_ns = 1'700'000'000'000'000'007;

using Recording = test::KnownRecording;

constexpr double kDepthGuess_m = 2;

Recording startingAt(std::int64_t start_ns) {
  Recording recording;
  recording.start_ns = start_ns;
  return recording;
}

KeyframePolicyOptions period(double window_s, double stride_s,
                             ReferenceTime reference = ReferenceTime::kMiddle) {
  KeyframePolicyOptions options;
  options.window_s = window_s;
  options.stride_s = stride_s;
  options.reference = reference;
  return options;
}

TEST(KeyframePolicy, ForwardLookingVehiclesReferToTheEnd) {
  const auto policy = makeKeyframePolicy(period(0.5, 0.5, ReferenceTime::kEnd), kDepthGuess_m);
  EXPECT_EQ(policy->current(startingAt(0))->t_ref_ns, 500'000'000);
}

TEST(KeyframePolicy, WindowsThatAreDroppedPieceByPieceCountOnce) {
  constexpr std::int64_t kMs = 1'000'000;
  KeyframePolicyOptions options = period(0.1, 0.1);
  options.window_events = 100;
  Recording recording = startingAt(0);
  for (int ms = 0; ms < 2000; ++ms) recording.events_ns.push_back(ms * kMs);
  recording.complete_ns = 0;  // like without poses: no window is complete
  for (const auto kind :
       {KeyframePolicyKind::kPeriod, KeyframePolicyKind::kEvents, KeyframePolicyKind::kBaseline}) {
    options.policy = kind;
    const auto policy = makeKeyframePolicy(options, kDepthGuess_m);
    std::uint64_t windows = 0;
    for (int ms = 0; ms <= 1000; ms += 7) windows += policy->dropWindowsBefore(recording, ms * kMs);
    EXPECT_EQ(windows, 10U) << nameOf(kind);  // until 994 ms
    EXPECT_EQ(policy->dropWindowsBefore(recording, 500 * kMs), 0U) << "not twice";
    EXPECT_EQ(policy->dropWindowsBefore(recording, 1001 * kMs), 1U) << nameOf(kind);
    EXPECT_EQ(policy->dropWindowsBefore(recording, 1501 * kMs), 5U) << nameOf(kind);
    policy->advance({1501 * kMs, 1601 * kMs, 1501 * kMs}, nullptr);
    EXPECT_EQ(policy->dropWindowsBefore(recording, 1701 * kMs), 1U) << nameOf(kind);
    if (kind == KeyframePolicyKind::kPeriod) continue;  // kPeriod windows do not depend on events
    policy->dropWindowsBefore(recording, 2000 * kMs);
    EXPECT_EQ(policy->dropWindowsBefore(recording, 9000 * kMs), 0U) << "there is no event";
  }
}

TEST(KeyframePolicy, ASingleWindowComesOnceUnlessItIsSkippedOrDropped) {
  const Recording recording = startingAt(kStart_ns);
  for (const std::int64_t t_ref_ns : {5, 15}) {
    const Window window{10, 20, t_ref_ns};
    const auto fresh = [&] { return makeGivenWindowsPolicy({window}); };
    auto policy = fresh();
    EXPECT_EQ(policy->current(recording)->t0_ns, 10);
    EXPECT_EQ(policy->earliestStart(recording), 10);
    EXPECT_EQ(policy->earliestLast(recording), 10);
    EXPECT_EQ(policy->earliestReference(recording), std::min<std::int64_t>(10, t_ref_ns));
    EXPECT_EQ(policy->advancePast(recording, 19), 0U);
    EXPECT_EQ(policy->dropWindowsBefore(recording, 10), 0U);
    EXPECT_FALSE(policy->last(recording, 20));
    policy->advance(window, nullptr);
    EXPECT_FALSE(policy->current(recording));
    EXPECT_EQ(policy->earliestStart(recording), kMaxTimeNs);
    EXPECT_EQ(policy->earliestReference(recording), kMaxTimeNs);
    EXPECT_EQ(policy->advancePast(recording, 99) + policy->dropWindowsBefore(recording, 99), 0U);
    policy = fresh();
    EXPECT_EQ(policy->advancePast(recording, 20), 1U);
    EXPECT_FALSE(policy->current(recording));
    policy = fresh();
    EXPECT_EQ(policy->dropWindowsBefore(recording, 11), 1U);
    EXPECT_FALSE(policy->current(recording));
  }
}

TEST(KeyframePolicy, StepsOfABaselineFitIntoTheWindow) {
  KeyframePolicyOptions baseline;
  baseline.policy = KeyframePolicyKind::kBaseline;
  EXPECT_NO_THROW(baseline.validate());
  baseline.stride_s = 0.21;
  EXPECT_THROW(makeKeyframePolicy(baseline, kDepthGuess_m), OptionError);
}

using test::KnownRecording;

constexpr std::int64_t kMs = 1'000'000;
constexpr std::int64_t kBaselineStart_ns = 1'700'000'000'000'000'000;

double secondsSinceStart(std::int64_t t_ns) {
  return 1e-9 * static_cast<double>(t_ns - kBaselineStart_ns);
}

Rigid3 turned(double angle_rad) {
  return {Eigen::Quaterniond(Eigen::AngleAxisd(angle_rad, Eigen::Vector3d::UnitY())),
          Eigen::Vector3d::Zero()};
}
/// Returns a recording with an event per millisecond for four seconds and a view of 53 degrees.
KnownRecording recordingOf(std::function<std::optional<Rigid3>(std::int64_t)> T_world_ref) {
  KnownRecording recording;
  recording.start_ns = kBaselineStart_ns;
  recording.complete_ns = kBaselineStart_ns + 4000 * kMs;
  for (int i = 0; i < 4000; ++i) recording.events_ns.push_back(kBaselineStart_ns + i * kMs);
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

/// Returns a keyframe at the origin with points at one depth in its whole image.
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
      const auto policy = makeKeyframePolicy(turning, kDepthGuess_m);
      if (by_the_keyframe)
        policy->advance({kBaselineStart_ns, kBaselineStart_ns, kBaselineStart_ns}, &seen);
      const auto window = policy->current(recording);
      ASSERT_TRUE(window);
      // 30 of 100 columns are out of view after atan(0.495) - atan(0.195) = 0.267 rad, four of the
      // guess's ten after atan(0.495) - atan(0.1485) = 0.312 rad. 24 of 80 rows are out after 0.222
      // rad, four of ten after 0.258 rad. A stride is 0.01 rad. Corners leave a little earlier.
      const double least =
          by_the_keyframe ? (sideways ? 0.267 : 0.222) : (sideways ? 0.312 : 0.258);
      const double angle = 0.5 * secondsSinceStart(window->t1_ns);
      EXPECT_GT(angle, 0.9 * least) << rad_s.transpose();
      EXPECT_LT(angle, least + 0.011) << rad_s.transpose();
    }
    turning.min_visible_fraction = 0;
    EXPECT_FALSE(makeKeyframePolicy(turning, kDepthGuess_m)->current(recording)) << "it may all go";
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
      const auto policy = makeKeyframePolicy(options(1.0, 0.05), kDepthGuess_m);
      if (by_the_keyframe)
        policy->advance({kBaselineStart_ns, kBaselineStart_ns, kBaselineStart_ns}, &seen);
      EXPECT_FALSE(policy->current(recording)) << size;
    }
  }
}

TEST(BaselinePolicy, RestAfterARotationMakesOneKeyframeNotOnePerStride) {
  const auto policy = makeKeyframePolicy(options(1.0, 0.05), kDepthGuess_m);
  const KeyframeDepthMap seen = keyframeThatSaw(2);
  policy->advance({kBaselineStart_ns, kBaselineStart_ns, kBaselineStart_ns}, &seen);
  // The camera looks away from these points and is at rest: nothing can be triangulated.
  const auto recording = recordingOf([](std::int64_t) { return turned(3.1); });
  const auto window = policy->current(recording);
  ASSERT_TRUE(window);
  EXPECT_EQ(window->t1_ns, kBaselineStart_ns + 50 * kMs) << "one stride is enough";
  const KeyframeDepthMap saw_nothing = keyframeThatSaw(0);
  policy->advance(*window, &saw_nothing);
  EXPECT_FALSE(policy->current(recording));
  EXPECT_GT(policy->earliestStart(recording), kBaselineStart_ns + 2900 * kMs)
      << "its events are let go";
}

/// `WindowPolicies` tests the other conditions.
TEST(BaselinePolicy, ALastWindowOfWhichLittleIsNewIsLeftOut) {
  const auto moving = recordingOf([](std::int64_t t_ns) {
    return Rigid3{Eigen::Quaterniond::Identity(), {0.9 * secondsSinceStart(t_ns), 0, 0}};
  });
  const auto policy = makeKeyframePolicy(options(0.3, 0.05), kDepthGuess_m);
  policy->advance(*policy->current(moving), nullptr);  // [0, 0.25)
  EXPECT_FALSE(policy->last(moving, kBaselineStart_ns + 250 * kMs)) << "all events are in a window";
  EXPECT_FALSE(policy->last(moving, kBaselineStart_ns + 274 * kMs)) << "less than a tenth";
  EXPECT_TRUE(policy->last(moving, kBaselineStart_ns + 276 * kMs));
  EXPECT_EQ(policy->earliestLast(moving), kBaselineStart_ns - 50 * kMs);
}

}  // namespace

}  // namespace efm::keyframe_policy_test
