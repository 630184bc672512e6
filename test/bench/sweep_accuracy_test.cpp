// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>
#include <opencv2/core.hpp>

#include <cmath>
#include <vector>

#include "mapping/geometry/lens.h"
#include "mapping/keyframes/keyframe_mapper.h"
#include "test/bench/synthetic_window.h"
#include "test/bench/unfused_keyframe.h"
#include "test/mapping/kernels/fast_kernels.h"
#include "test/mapping/keyframes/random_scene.h"
#include "test/mapping/sweep/sweep_case.h"
#include "test/oracle/naive_mapper.h"

namespace efm::bench {
namespace {

/// The fused and the unfused keyframe are timed: they must do the same work.
TEST(UnfusedKeyframe, FindsTheDepthsOfTheMapper) {
  SyntheticWindowOptions size;
  size.width = 173;
  size.height = 130;
  size.events_per_camera = 40'000;
  SyntheticWindow made = makeSyntheticWindow(size);
  made.options.sweep.kernel = VotingKernel::kPlain;
  const std::vector<EventSpan> events(made.events.begin(), made.events.end());

  KeyframeMapper mapper(made.rig, {0, 1}, made.options);
  const auto fused = mapper.map(made.window, events, made.trajectory);
  UnfusedKeyframe reference(made.rig, made.options);
  reference.map(made.window, events, made.trajectory);  // a previous keyframe must not matter
  const auto unfused = reference.map(made.window, events, made.trajectory);

  ASSERT_TRUE(fused && unfused);
  const int found = cv::countNonZero(fused->map.depth > 0);
  ASSERT_GT(found, 500);
  // The order of additions differs: values at the threshold may differ.
  const cv::Mat1b differ = cv::abs(fused->map.depth - unfused->depth) > 1e-3;
  EXPECT_LE(cv::countNonZero(differ), found / 500);
  EXPECT_LT(cv::norm(fused->map.confidence, unfused->confidence, cv::NORM_INF), 1e-3);
}

}  // namespace

}  // namespace efm::bench

namespace efm {
namespace {

using bench::SweepInput;
using bench::SyntheticWindow;
using bench::SyntheticWindowOptions;

// Limits for every kernel, compared with the oracle with the same packets.
constexpr double kMaxError = 1e-3;        // fraction of the DSI's sum
constexpr double kMaxSignedError = 3e-5;  // fraction of the DSI's sum
// Fraction of the pixels with votes. Weights are rounded to 1/1024 of a vote: if two planes differ
// by less, rounding decides which plane is the peak.
constexpr double kMinEqualPeaks = 0.975;
// The min of two cameras is often a single vote, which changes little between planes.
constexpr double kMinEqualPeaksOfMin = 0.965;

constexpr int kPlanes = 50;

/// A stereo keyframe: the input of the sweep, and the DSIs of the oracle.
struct Keyframe {
  test::SweepCase input;
  std::vector<oracle::Dsi> exact;  // per camera
};

Keyframe keyframeOf(const SyntheticWindow& made) {
  const SweepInput input = makeSweepInput(made, kPlanes);
  Keyframe keyframe{{input.view, input.planes, input.cameras}, {}};
  for (std::size_t c = 0; c < made.events.size(); ++c) {
    const UndistortionTable undistortion(made.rig.cameras[c].model);
    keyframe.exact.push_back(
        oracle::rayDensity(oracle::poseByPacket(made.events[c], input.packets[c]), undistortion,
                           input.view, input.planes));
  }
  return keyframe;
}

/// Returns half the size of a DAVIS346 with the same number of events per pixel.
SyntheticWindowOptions halfSize() {
  SyntheticWindowOptions options;
  options.width = 173;
  options.height = 130;
  options.events_per_camera = 60'000;
  return options;
}

const Keyframe& edges() {
  static const Keyframe kKeyframe = keyframeOf(makeSyntheticWindow(halfSize()));
  return kKeyframe;
}

/// Returns a keyframe of the same rig and motion with random events, without clear peaks.
const Keyframe& noise() {
  static const Keyframe kKeyframe = [] {
    const SyntheticWindowOptions options = halfSize();
    SyntheticWindow made = makeSyntheticWindow(options);
    test::RandomScene random(3);
    for (std::size_t c = 0; c < made.events.size(); ++c) {
      made.events[c] = random.events(made.rig.cameras[c].model, options.events_per_camera,
                                     made.window.t0_ns, made.window.t1_ns - made.window.t0_ns);
    }
    return keyframeOf(made);
  }();
  return kKeyframe;
}

/// Returns the fraction of pixels with votes whose peak is on the exact plane.
double equalPeaks(const SweepResult& result, const oracle::Dsi& exact) {
  const std::vector<int> planes = oracle::peakPlanes(exact);
  const std::vector<double> values = oracle::peakValues(exact);
  double with_votes = 0;
  double equal = 0;
  for (std::size_t i = 0; i < planes.size(); ++i) {
    if (values[i] <= 0) continue;
    const auto x = static_cast<int>(i) % exact.width;
    const auto y = static_cast<int>(i) / exact.width;
    ++with_votes;
    if (result.fused.peaks.plane(y, x) == planes[i]) ++equal;
  }
  EXPECT_GT(with_votes, 0);
  return equal / with_votes;
}

class SweepAccuracyOn : public ::testing::TestWithParam<VotingKernel> {
 protected:
  static void expectExact(const Keyframe& keyframe, FusionRule rule) {
    test::SweepCase input = keyframe.input;
    input.fusion.across_cameras = rule;
    const test::SweepOutput swept = sweep(input, GetParam(), 2);
    const oracle::Dsi exact = oracle::fuse(rule, keyframe.exact);
    const test::DsiDifference difference = test::differenceOf(swept.dsi, exact.values);
    const double equal_peaks = equalPeaks(swept.result, exact);
    EXPECT_LE(difference.error, kMaxError) << nameOf(rule);
    EXPECT_LE(std::abs(difference.signed_error), kMaxSignedError) << nameOf(rule);
    EXPECT_GE(equal_peaks, rule == FusionRule::kMin ? kMinEqualPeaksOfMin : kMinEqualPeaks)
        << nameOf(rule);
  }
};

INSTANTIATE_TEST_SUITE_P(Kernels, SweepAccuracyOn, ::testing::ValuesIn(availableKernels()),
                         test::nameOfKernel);

TEST_P(SweepAccuracyOn, EventsOfEdgesGiveTheOraclesDsiAndPeaksWithEveryRule) {
  for (const FusionRule rule : allFusionRules()) expectExact(edges(), rule);
}

TEST_P(SweepAccuracyOn, RandomEventsGiveTheOraclesDsiAndPeaksWithEveryRule) {
  for (const FusionRule rule : allFusionRules()) expectExact(noise(), rule);
}

}  // namespace

}  // namespace efm
