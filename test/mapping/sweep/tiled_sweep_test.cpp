// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/sweep/tiled_sweep.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <vector>

#include "test/mapping/depth/same_image.h"
#include "test/mapping/dsi/swept_dsi.h"
#include "test/mapping/kernels/fast_kernels.h"
#include "test/mapping/rays/random_rays.h"
#include "test/mapping/sweep/plain_sweep.h"

namespace efm {
namespace {

using test::RandomRays;
using test::SweepCase;
using test::SweptDsi;

class TiledSweepOn : public ::testing::TestWithParam<VotingKernel> {};

INSTANTIATE_TEST_SUITE_P(Kernels, TiledSweepOn, ::testing::ValuesIn(test::fastKernels()),
                         test::nameOfKernel);

/// Where tiles of 63 pixels end, and vectors of up to 16.
const std::vector<cv::Size> kOddSizes = {{1, 1},   {2, 2},    {1, 50},   {50, 1},    {2, 64},
                                         {17, 16}, {63, 63},  {64, 64},  {65, 127},  {126, 126},
                                         {127, 3}, {128, 62}, {190, 33}, {200, 130}, {63, 190}};

void expectSame(const SweptDsi& a, const SweptDsi& b) {
  EXPECT_EQ(a.dsi, b.dsi);
  EXPECT_TRUE(test::same(a.result.fused.peaks, b.result.fused.peaks));
  ASSERT_EQ(a.result.cameras.size(), b.result.cameras.size());
  for (std::size_t c = 0; c < a.result.cameras.size(); ++c) {
    EXPECT_TRUE(test::same(a.result.cameras[c].peaks, b.result.cameras[c].peaks)) << "camera " << c;
    EXPECT_EQ(a.result.votes[c].cast, b.result.votes[c].cast);
    EXPECT_EQ(a.result.votes[c].outside_view, b.result.votes[c].outside_view);
    EXPECT_EQ(a.result.votes[c].behind_camera, b.result.votes[c].behind_camera);
  }
}

TEST_P(TiledSweepOn, TheNumberOfThreadsChangesNoBitOfDsiPeaksOrCountsForViewsOfAnySize) {
  const tbb::global_control as_if_eight_cores(tbb::global_control::max_allowed_parallelism, 8);
  std::uint32_t seed = 0;
  for (const cv::Size& size : kOddSizes) {
    RandomRays random(++seed);
    SweepCase input{random.view(size), DepthPlanes({0.5, 5.0, 13, PlaneSpacing::kInverse}), {}, {}};
    for (int camera = 0; camera < 2; ++camera) {
      input.cameras.push_back({random.bundle(input.view, input.planes, 900),
                               random.bundle(input.view, input.planes, 700)});
    }
    const SweptDsi one = sweep(input, GetParam(), 1);
    for (const int threads : {2, 3, 8}) {
      SCOPED_TRACE(testing::Message()
                   << size.width << " x " << size.height << " with " << threads << " threads");
      expectSame(one, sweep(input, GetParam(), threads));
    }
  }
}

TEST_P(TiledSweepOn, NeitherASinkNorCameraPeaksChangeTheResult) {
  RandomRays random(7);
  SweepCase input{
      random.view({130, 70}), DepthPlanes({0.5, 5.0, 9, PlaneSpacing::kInverse}), {}, {}};
  for (int camera = 0; camera < 2; ++camera) {
    input.cameras.push_back({random.bundle(input.view, input.planes, 4000)});
  }
  SpaceSweepOptions options;
  options.fusion = input.fusion;
  options.kernel = GetParam();
  const SweepResult plainest = SpaceSweep(options).run(input.cameras, input.view, input.planes);
  EXPECT_TRUE(test::same(plainest.fused.peaks, sweep(input, GetParam()).result.fused.peaks));
  EXPECT_TRUE(plainest.cameras.empty());
}

TEST_P(TiledSweepOn, ThePeaksAreThoseOfTheDsiItHandsOut) {
  for (const cv::Size& size : kOddSizes) {
    RandomRays random(11);
    SweepCase input{random.view(size), DepthPlanes({0.5, 5.0, 7, PlaneSpacing::kInverse}), {}, {}};
    input.cameras.push_back({random.bundle(input.view, input.planes, 2000)});
    const SweptDsi swept = sweep(input, GetParam(), 2);
    for (std::size_t pixel = 0; pixel < input.view.pixels(); ++pixel) {
      int best = 0;
      const auto value = [&](int plane) {
        return swept.dsi[static_cast<std::size_t>(plane) * input.view.pixels() + pixel];
      };
      for (int plane = 1; plane < 7; ++plane) {
        if (value(plane) > value(best)) best = plane;
      }
      const auto index = static_cast<int>(pixel);
      ASSERT_EQ(swept.result.fused.peaks.plane(index / size.width, index % size.width), best);
      ASSERT_EQ(swept.result.fused.peaks.confidence(index / size.width, index % size.width),
                value(best));
    }
  }
}

TEST_P(TiledSweepOn, RandomRigsPlanesAndViewsAreThePlainKernelsWithinRounding) {
  for (std::uint32_t seed = 1; seed <= 40; ++seed) {
    RandomRays random(seed);
    const cv::Size size(random.integer(2, 200), random.integer(2, 150));
    SweepCase input{random.view(size), random.planes(), {}};
    const int cameras = random.integer(1, 3);
    const int slots = random.integer(1, 3);
    for (int camera = 0; camera < cameras; ++camera) {
      CameraRays& of_camera = input.cameras.emplace_back();
      for (int slot = 0; slot < slots; ++slot) {
        of_camera.push_back(random.bundle(input.view, input.planes, random.integer(0, 3000)));
      }
    }
    SCOPED_TRACE(testing::Message()
                 << "seed " << seed << ", " << size.width << " x " << size.height);
    test::expectThePlainSweep(input, GetParam());
  }
}

TEST_P(TiledSweepOn, ViewsOfAnySizeAreThePlainKernels) {
  for (const cv::Size& size : kOddSizes) {
    RandomRays random(3);
    SweepCase input{random.view(size), DepthPlanes({0.5, 5.0, 7, PlaneSpacing::kInverse}), {}};
    input.cameras.push_back({random.bundle(input.view, input.planes, 5000)});
    SCOPED_TRACE(testing::Message() << size.width << " x " << size.height);
    test::expectThePlainSweep(input, GetParam());
  }
}

}  // namespace
}  // namespace efm
