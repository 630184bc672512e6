// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/keyframe_policy.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <limits>
#include <vector>

#include <stdexcept>

namespace efm {
namespace {

constexpr std::int64_t kStart_ns = 1'700'000'000'000'000'007;

constexpr double kDepthGuess_m = 2;

/// A recording of one camera that is known up to some time.
class Recording : public RecordingSoFar {
 public:
  std::int64_t start_ns = 0;
  std::int64_t complete_ns = std::numeric_limits<std::int64_t>::max() / 2;
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
  std::optional<Rigid3> T_world_ref(std::int64_t t_ns) const override {
    return T_world_ref_at(t_ns);
  }
  const ReferenceView& view() const override { return image; }
};

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

TEST(KeyframePolicy, WindowKStartsKStridesAfterTheStart) {
  const auto policy = makeKeyframePolicy(period(0.5, 0.2), kDepthGuess_m);
  for (int k = 0; k < 5; ++k) {
    const auto window = policy->current(startingAt(kStart_ns));
    ASSERT_TRUE(window);
    EXPECT_EQ(window->t0_ns, kStart_ns + k * 200'000'000);
    EXPECT_EQ(window->t1_ns, window->t0_ns + 500'000'000);
    EXPECT_EQ(window->t_ref_ns, window->t0_ns + 250'000'000);
    policy->advance(*window, nullptr);
  }
}

TEST(KeyframePolicy, ForwardLookingVehiclesReferToTheEnd) {
  const auto policy = makeKeyframePolicy(period(0.5, 0.5, ReferenceTime::kEnd), kDepthGuess_m);
  EXPECT_EQ(policy->current(startingAt(0))->t_ref_ns, 500'000'000);
}

TEST(KeyframePolicy, WindowsThatEndByATimeArePassedTogether) {
  const auto policy = makeKeyframePolicy(period(0.5, 0.2), kDepthGuess_m);
  EXPECT_EQ(policy->advancePast(startingAt(0), 499'999'999), 0U);
  EXPECT_EQ(policy->advancePast(startingAt(0), 500'000'000), 1U);
  EXPECT_EQ(policy->current(startingAt(0))->t0_ns, 200'000'000);
  EXPECT_EQ(policy->advancePast(startingAt(0), 500'000'000), 0U) << "not twice";
  EXPECT_EQ(policy->advancePast(startingAt(0), 1'000'000'000'000'000'000), 4'999'999'997U);
  EXPECT_GT(policy->current(startingAt(0))->t1_ns, 1'000'000'000'000'000'000);
}

TEST(KeyframePolicy, ASingleWindowComesOnce) {
  const auto policy = makeSingleWindowPolicy({10, 20, 15});
  ASSERT_TRUE(policy->current(startingAt(kStart_ns)));
  EXPECT_EQ(policy->current(startingAt(kStart_ns))->t0_ns, 10);
  policy->advance({10, 20, 15}, nullptr);
  EXPECT_FALSE(policy->current(startingAt(kStart_ns)));
}

TEST(KeyframePolicy, OptionsOutOfRangeAreNamed) {
  KeyframePolicyOptions options;
  options.window_s = 0;
  EXPECT_THAT(
      [&] { makeKeyframePolicy(options, kDepthGuess_m); },
      ::testing::ThrowsMessage<std::invalid_argument>(::testing::HasSubstr("window_s = 0")));
  options = {};
  options.stride_s = -1;
  EXPECT_THAT(
      [&] { makeKeyframePolicy(options, kDepthGuess_m); },
      ::testing::ThrowsMessage<std::invalid_argument>(::testing::HasSubstr("stride_s = -1")));
}

}  // namespace
}  // namespace efm
