// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/keyframes/keyframe_policy.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "test/mapping/base/refused_option.h"
#include "test/mapping/keyframes/known_recording.h"

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

TEST(KeyframePolicy, WindowsThatAreGivenUpPieceByPieceCountOnce) {
  constexpr std::int64_t kMs = 1'000'000;
  KeyframePolicyOptions options = period(0.1, 0.1);
  options.window_events = 100;
  Recording recording = startingAt(0);
  for (int ms = 0; ms < 2000; ++ms) recording.events_ns.push_back(ms * kMs);
  recording.complete_ns = 0;  // as without poses: no window is known
  for (const auto kind :
       {KeyframePolicyKind::kPeriod, KeyframePolicyKind::kEvents, KeyframePolicyKind::kBaseline}) {
    options.policy = kind;
    const auto policy = makeKeyframePolicy(options, kDepthGuess_m);
    std::uint64_t windows = 0;
    for (int ms = 0; ms <= 1000; ms += 7) windows += policy->giveUpBefore(recording, ms * kMs);
    EXPECT_EQ(windows, 10U) << nameOf(kind);  // until 994 ms
    EXPECT_EQ(policy->giveUpBefore(recording, 500 * kMs), 0U) << "not twice";
    EXPECT_EQ(policy->giveUpBefore(recording, 1001 * kMs), 1U) << nameOf(kind);
    EXPECT_EQ(policy->giveUpBefore(recording, 1501 * kMs), 5U) << nameOf(kind);
    policy->advance({1501 * kMs, 1601 * kMs, 1501 * kMs}, nullptr);
    EXPECT_EQ(policy->giveUpBefore(recording, 1701 * kMs), 1U) << nameOf(kind);
    if (kind == KeyframePolicyKind::kPeriod) continue;  // its windows do not depend on events
    policy->giveUpBefore(recording, 2000 * kMs);
    EXPECT_EQ(policy->giveUpBefore(recording, 9000 * kMs), 0U) << "there is no event";
  }
}

TEST(KeyframePolicy, ASingleWindowComesOnceUnlessItIsSkippedOrGivenUp) {
  const Recording recording = startingAt(kStart_ns);
  for (const std::int64_t t_ref_ns : {5, 15}) {
    const Window window{10, 20, t_ref_ns};
    const auto fresh = [&] { return makeSingleWindowPolicy(window); };
    auto policy = fresh();
    EXPECT_EQ(policy->current(recording)->t0_ns, 10);
    EXPECT_EQ(policy->earliestStart(recording), 10);
    EXPECT_EQ(policy->earliestLast(recording), 10);
    EXPECT_EQ(policy->earliestReference(recording), std::min<std::int64_t>(10, t_ref_ns));
    EXPECT_EQ(policy->advancePast(recording, 19), 0U);
    EXPECT_EQ(policy->giveUpBefore(recording, 10), 0U);
    EXPECT_FALSE(policy->last(recording, 20));
    policy->advance(window, nullptr);
    EXPECT_FALSE(policy->current(recording));
    EXPECT_EQ(policy->earliestStart(recording), kMaxTimeNs);
    EXPECT_EQ(policy->earliestReference(recording), kMaxTimeNs);
    EXPECT_EQ(policy->advancePast(recording, 99) + policy->giveUpBefore(recording, 99), 0U);
    policy = fresh();
    EXPECT_EQ(policy->advancePast(recording, 20), 1U);
    EXPECT_FALSE(policy->current(recording));
    policy = fresh();
    EXPECT_EQ(policy->giveUpBefore(recording, 11), 1U);
    EXPECT_FALSE(policy->current(recording));
  }
}

TEST(KeyframePolicy, OptionsHaveTheirLimits) {
  using O = KeyframePolicyOptions;
  const std::vector<double> not_seconds = {0.9e-6, 1'000'001, NAN};
  test::expectLimits<O>(
      {{"window_s", &O::window_s, {1e-6, 1e6}, not_seconds},
       {"stride_s", &O::stride_s, {1e-6, 1e6}, not_seconds},
       {"window_events", &O::window_events, {1, 1e15}, {0, -1}},
       {"min_baseline_ratio", &O::min_baseline_ratio, {1e-9, 10}, {0, -1, 10.1, NAN}},
       {"min_visible_fraction", &O::min_visible_fraction, {0, 1}, {-0.1, 1.1, NAN}}});
  O baseline;
  baseline.policy = KeyframePolicyKind::kBaseline;
  test::expectLimits<O>({{"stride_s", &O::stride_s, {0.2}, {0.21}}}, baseline);
  baseline.stride_s = 0.25;
  EXPECT_THROW(makeKeyframePolicy(baseline, kDepthGuess_m), std::invalid_argument);
}

}  // namespace
}  // namespace efm::keyframe_policy_test
