// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/sweep/space_sweep.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <opencv2/core.hpp>

#include "test/mapping/depth/same_image.h"
#include "test/mapping/dsi/kept_dsi.h"
#include "test/mapping/kernels/fast_kernels.h"
#include "test/mapping/keyframes/random_scene.h"
#include "test/oracle/naive_mapper.h"

namespace efm {
namespace {

using test::KeptDsi;
using test::RandomScene;
using test::same;

constexpr std::int64_t kStart_ns = 0;

/// Cameras around the origin that see random events.
struct Input {
  ReferenceView view = ReferenceView::of(test::smallCamera());
  DepthPlanes planes;
  std::vector<RayBundle> rays;
  std::vector<oracle::Dsi> densities;  // the oracle's, in the same poses
  std::vector<VoteCounts> counts;
};

Input makeInput(std::uint32_t seed, int cameras, int planes, std::size_t events_per_camera) {
  RandomScene random(seed);
  Input input;
  input.planes = DepthPlanes({0.4, 4.0, planes, PlaneSpacing::kInverse});
  const Trajectory trajectory = random.motion(kStart_ns, 0.1, 3.0, 4.0);
  for (int c = 0; c < cameras; ++c) {
    const RigCamera camera{test::smallCamera(), random.pose(0.2, 0.3), 0};
    const UndistortionTable undistortion(camera.model);
    const auto events = random.events(camera.model, events_per_camera, kStart_ns, 100'000'000);
    const PacketGeometry geometry{{}, input.view, 0.4, 4.0};
    const PosePackets packets =
        splitIntoPosePackets(events, camera, undistortion, trajectory, geometry, {0.02});
    input.rays.push_back(backProject(events, packets, undistortion, input.view));
    VoteCounts counts;
    input.densities.push_back(oracle::rayDensity(oracle::poseByPacket(events, packets),
                                                 undistortion, input.view, input.planes, &counts));
    input.counts.push_back(counts);
  }
  return input;
}

class SpaceSweepOn : public ::testing::TestWithParam<VotingKernel> {
 protected:
  static SweepResult sweep(const Input& input, FusionRule rule, int threads,
                           DsiSink* sink = nullptr) {
    SpaceSweepOptions options;
    options.fusion.across_cameras = rule;
    options.threads = threads;
    options.kernel = GetParam();
    std::vector<CameraRays> rays;
    for (const RayBundle& camera : input.rays) rays.push_back({camera});
    return SpaceSweep(options).run(rays, input.view, input.planes, {false, sink});
  }
};

INSTANTIATE_TEST_SUITE_P(Kernels, SpaceSweepOn, ::testing::ValuesIn(availableKernels()),
                         test::nameOfKernel);

TEST_P(SpaceSweepOn, TheDsiIsTheOraclesForEveryRuleAndOneToThreeCameras) {
  for (int cameras = 1; cameras <= 3; ++cameras) {
    const Input input = makeInput(7, cameras, 11, 4000);
    for (const FusionRule rule : allFusionRules()) {
      KeptDsi dsi(input.planes, input.view);
      sweep(input, rule, 2, &dsi);
      EXPECT_EQ(dsi.planesSeen(), 11U);
      const oracle::Dsi exact = oracle::fuse(rule, input.densities);
      EXPECT_LE(test::errorOverMass(dsi.values, exact), test::errorOverMassOf(GetParam()))
          << nameOf(rule) << " of " << cameras;
    }
  }
}

TEST_P(SpaceSweepOn, VotesAreCountedAsTheOracleCountsThem) {
  const Input input = makeInput(8, 2, 9, 3000);
  const SweepResult result = sweep(input, FusionRule::kHarmonic, 2);
  ASSERT_EQ(result.votes.size(), 2U);
  for (std::size_t c = 0; c < 2; ++c) {
    EXPECT_EQ(result.votes[c].total(), input.rays[c].size() * 9);
    EXPECT_EQ(result.votes[c].behind_camera, input.counts[c].behind_camera);
    // A vote within 1/4096 px of the border may fall on either side of it: of 27,000 votes over
    // 48 x 36 px, some 27,000 * 2 * (1/48 + 1/36) / 4096 = 0.6.
    EXPECT_NEAR(static_cast<double>(result.votes[c].cast),
                static_cast<double>(input.counts[c].cast), 3);
  }
}

TEST_P(SpaceSweepOn, ThePeakAndItsNeighboursAreThoseOfTheVolume) {
  for (const int planes : {1, 2, 3, 17}) {
    for (const int threads : {1, 2, 5}) {
      const Input input = makeInput(9, 2, planes, 3000);
      KeptDsi dsi(input.planes, input.view);
      const DsiPeaks peaks = sweep(input, FusionRule::kArithmetic, threads, &dsi).fused.peaks;
      const auto value = [&](int plane, int x, int y) {
        if (plane < 0 || plane >= planes) return -1.0F;
        return dsi
            .values[(static_cast<std::size_t>(plane) * 36 + static_cast<std::size_t>(y)) * 48 +
                    static_cast<std::size_t>(x)];
      };
      for (int y = 0; y < 36; ++y) {
        for (int x = 0; x < 48; ++x) {
          int best = 0;
          for (int plane = 1; plane < planes; ++plane) {
            if (value(plane, x, y) > value(best, x, y)) best = plane;
          }
          ASSERT_EQ(peaks.plane(y, x), best) << x << ", " << y << " of " << planes;
          ASSERT_EQ(peaks.confidence(y, x), value(best, x, y));
          ASSERT_EQ(peaks.before(y, x), value(best - 1, x, y));
          ASSERT_EQ(peaks.after(y, x), value(best + 1, x, y));
        }
      }
    }
  }
}

TEST_P(SpaceSweepOn, TheNumberOfThreadsNeverChangesTheResult) {
  const Input input = makeInput(10, 3, 50, 3000);
  for (const FusionRule rule : allFusionRules()) {
    const SweepResult one = sweep(input, rule, 1);
    for (const int threads : {2, 3, 16, 64}) {
      const SweepResult many = sweep(input, rule, threads);
      EXPECT_TRUE(same(one.fused.peaks.confidence, many.fused.peaks.confidence)) << threads;
      EXPECT_TRUE(same(one.fused.peaks.plane, many.fused.peaks.plane)) << threads;
      EXPECT_TRUE(same(one.fused.peaks.before, many.fused.peaks.before)) << threads;
      EXPECT_TRUE(same(one.fused.peaks.after, many.fused.peaks.after)) << threads;
    }
  }
}

TEST_P(SpaceSweepOn, WithoutEventsEveryPeakIsZeroAtTheNearestPlane) {
  Input input = makeInput(11, 2, 5, 100);
  input.rays = {RayBundle(), RayBundle()};
  const DsiPeaks peaks = sweep(input, FusionRule::kHarmonic, 2).fused.peaks;
  EXPECT_EQ(cv::countNonZero(peaks.confidence), 0);
  EXPECT_EQ(cv::countNonZero(peaks.plane), 0);
}

TEST_P(SpaceSweepOn, ASilentCameraSilencesTheAndLikeRules) {
  Input input = makeInput(12, 2, 5, 1000);
  input.rays[1] = RayBundle();
  EXPECT_EQ(cv::countNonZero(sweep(input, FusionRule::kHarmonic, 1).fused.peaks.confidence), 0);
  EXPECT_GT(cv::countNonZero(sweep(input, FusionRule::kArithmetic, 1).fused.peaks.confidence), 0);
}

TEST(SpaceSweep, ThreadsOutOfRangeAreNamed) {
  SpaceSweepOptions options;
  options.threads = 0;
  EXPECT_THAT([&] { SpaceSweep sweep(options); },
              ::testing::ThrowsMessage<std::invalid_argument>(::testing::HasSubstr("threads = 0")));
}

}  // namespace
}  // namespace efm
