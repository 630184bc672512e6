// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/dsi/dsi_columns.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <random>
#include <vector>

#include "mapping/sweep/view_tiles.h"
#include "test/mapping/depth/same_image.h"
#include "test/mapping/dsi/swept_dsi.h"
#include "test/mapping/kernels/fast_kernels.h"
#include "test/mapping/rays/random_rays.h"

namespace efm {
namespace {

using test::RandomRays;
using test::SweepCase;

/// Rounded to whole units, in floats of up to 65535.
constexpr float kUnits = 0.51F / 65535;

/// Two cameras whose rays are everywhere in the view, more of them in some places.
SweepCase stereoCase(const cv::Size& size, int planes, int window) {
  RandomRays random(static_cast<std::uint32_t>(size.area() + planes));
  SweepCase input{random.view(size), DepthPlanes({0.5, 5.0, planes, PlaneSpacing::kInverse}), {}};
  for (int camera = 0; camera < 2; ++camera) {
    input.cameras.push_back({random.bundle(input.view, input.planes, 3000)});
  }
  input.ray_window = window;
  return input;
}

const std::vector<cv::Size> kSizes = {{1, 1},   {2, 2},   {1, 50},   {3, 4},    {17, 16},
                                      {63, 63}, {64, 64}, {65, 127}, {130, 66}, {190, 33}};

void expectRaysOf(const DsiRays& rays, const cv::Mat1f& confidence, const std::vector<float>& dsi) {
  const std::size_t pixels = confidence.total();
  for (int y = 0; y < confidence.rows; ++y) {
    for (int x = 0; x < confidence.cols; ++x) {
      if (!rays.has({x, y})) continue;
      for (int plane = 0; plane < rays.planes(); ++plane) {
        const float exact = dsi[static_cast<std::size_t>(plane) * pixels +
                                static_cast<std::size_t>(y * confidence.cols + x)];
        ASSERT_NEAR(rays.value({x, y}, plane), exact, kUnits * confidence(y, x))
            << x << ", " << y << ", plane " << plane;
      }
    }
  }
}

/// The number of pixels that have a ray.
std::size_t pixelsWithRays(const DsiRays& rays, const cv::Size& size) {
  std::size_t count = 0;
  for (int y = 0; y < size.height; ++y) {
    for (int x = 0; x < size.width; ++x) count += rays.has({x, y}) ? 1 : 0;
  }
  return count;
}

class DsiRaysOn : public ::testing::TestWithParam<VotingKernel> {};

INSTANTIATE_TEST_SUITE_P(Kernels, DsiRaysOn, ::testing::ValuesIn(availableKernels()),
                         test::nameOfKernel);

TEST_P(DsiRaysOn, EveryRayIsTheDsiWithinSixteenBits) {
  for (const cv::Size& size : kSizes) {
    for (const int planes : {1, 2, 9}) {
      SCOPED_TRACE(testing::Message() << size.width << " x " << size.height << ", " << planes);
      const test::SweptDsi swept = sweep(stereoCase(size, planes, 5), GetParam(), 2);
      EXPECT_EQ(swept.result.fused.rays.planes(), planes);
      EXPECT_EQ(swept.result.fused.rays.size(), pixelsWithRays(swept.result.fused.rays, size));
      expectRaysOf(swept.result.fused.rays, swept.result.fused.peaks.confidence, swept.dsi);
    }
  }
}

TEST_P(DsiRaysOn, OfFiveHundredPlanesToo) {
  const test::SweptDsi swept = sweep(stereoCase({70, 40}, 500, 5), GetParam(), 2);
  EXPECT_GT(swept.result.fused.rays.size(), 100U);
  expectRaysOf(swept.result.fused.rays, swept.result.fused.peaks.confidence, swept.dsi);
}

TEST_P(DsiRaysOn, OfEachCameraAreThoseOfItsOwnSweep) {
  SweepCase input = stereoCase({80, 70}, 9, 5);
  const test::SweptDsi all = sweep(input, GetParam(), 2);
  ASSERT_EQ(all.result.cameras.size(), 2U);
  for (std::size_t c = 0; c < 2; ++c) {
    SweepCase one = input;
    one.cameras = {input.cameras[c]};
    const test::SweptDsi alone = sweep(one, GetParam(), 1);
    const DsiRays& rays = all.result.cameras[c].rays;
    EXPECT_GT(rays.size(), 100U);
    expectRaysOf(rays, alone.result.fused.peaks.confidence, alone.dsi);
    for (int y = 0; y < 70; ++y) {
      for (int x = 0; x < 80; ++x) {
        ASSERT_EQ(rays.has({x, y}), alone.result.fused.rays.has({x, y})) << x << ", " << y;
      }
    }
  }
}

TEST_P(DsiRaysOn, NoneAreKeptWhereNoneAreAskedForAndPeaksStayTheSame) {
  SweepCase input = stereoCase({80, 70}, 9, 5);
  const test::SweptDsi with = sweep(input, GetParam());
  input.ray_window = 0;
  const test::SweptDsi without = sweep(input, GetParam());
  EXPECT_GT(with.result.fused.rays.size(), 100U);
  EXPECT_EQ(without.result.fused.rays.size(), 0U);
  EXPECT_TRUE(test::same(with.result.fused.peaks, without.result.fused.peaks));
}

TEST_P(DsiRaysOn, TheNumberOfThreadsChangesNone) {
  const tbb::global_control as_if_eight_cores(tbb::global_control::max_allowed_parallelism, 8);
  for (const cv::Size& size : kSizes) {
    const SweepCase input = stereoCase(size, 9, 5);
    const test::SweptDsi one = sweep(input, GetParam(), 1);
    for (const int threads : {2, 8}) {
      const test::SweptDsi many = sweep(input, GetParam(), threads);
      for (int y = 0; y < size.height; ++y) {
        for (int x = 0; x < size.width; ++x) {
          const DsiRays& rays = one.result.fused.rays;
          ASSERT_EQ(rays.has({x, y}), many.result.fused.rays.has({x, y}));
          if (!rays.has({x, y})) continue;
          for (int plane = 0; plane < 9; ++plane) {
            ASSERT_EQ(rays.value({x, y}, plane), many.result.fused.rays.value({x, y}, plane));
          }
        }
      }
    }
  }
}

/// Weights of OpenCV's Gaussian of a side: binomial where it is 3 or 5.
std::vector<double> gaussianOf(int side) {
  if (side == 3) return {0.25, 0.5, 0.25};
  if (side == 5) return {1 / 16.0, 4 / 16.0, 6 / 16.0, 4 / 16.0, 1 / 16.0};
  const double sigma = 0.3 * ((side - 1) * 0.5 - 1) + 0.8;
  std::vector<double> weights;
  double sum = 0;
  for (int i = 0; i < side; ++i) {
    const double from_middle = i - side / 2;
    sum += weights.emplace_back(std::exp(-from_middle * from_middle / (2 * sigma * sigma)));
  }
  for (double& weight : weights) weight /= sum;
  return weights;
}

/// The Gaussian mean around a pixel whose window lies wholly inside the image.
double surroundingsOf(const cv::Mat1f& confidence, const cv::Point& pixel, int side) {
  const std::vector<double> weights = gaussianOf(side);
  double sum = 0;
  for (int j = 0; j < side; ++j) {
    for (int i = 0; i < side; ++i) {
      sum += weights[static_cast<std::size_t>(j)] * weights[static_cast<std::size_t>(i)] *
             double{confidence(pixel.y + j - side / 2, pixel.x + i - side / 2)};
    }
  }
  return sum;
}

TEST_P(DsiRaysOn, ArePickedWhereConfidenceIsAboveItsSurroundingsAndAtTheEdgesOfTilesEverywhere) {
  constexpr double kRounding = 1e-4;  // of the mean: too near to be told apart
  for (const int window : {3, 5, 11, 63, 255}) {
    for (const cv::Size& size : {cv::Size(4, 3), {64, 64}, {150, 70}}) {
      const SweepCase input = stereoCase(size, 3, window);
      const SweptDsi swept = sweep(input, GetParam()).result.fused;
      const cv::Mat1f& confidence = swept.peaks.confidence;
      const std::vector<cv::Rect> tiles =
          GetParam() == VotingKernel::kPlain
              ? std::vector<cv::Rect>{{0, 0, size.width, size.height}}
              : tilesOf(input.view, 63);
      int left_out = 0;
      for (const cv::Rect& tile : tiles) {
        const int reach = window / 2;
        for (int y = tile.y; y < tile.br().y; ++y) {
          for (int x = tile.x; x < tile.br().x; ++x) {
            const bool whole = x - reach >= tile.x && x + reach < tile.br().x &&
                               y - reach >= tile.y && y + reach < tile.br().y;
            if (!whole) {
              ASSERT_EQ(swept.rays.has({x, y}), confidence(y, x) > 0) << x << ", " << y;
              continue;
            }
            const double around = surroundingsOf(confidence, {x, y}, window);
            if (confidence(y, x) > (1 + kRounding) * around) {
              ASSERT_TRUE(swept.rays.has({x, y})) << x << ", " << y;
            } else if (confidence(y, x) < (1 - kRounding) * around) {
              ASSERT_FALSE(swept.rays.has({x, y})) << x << ", " << y;
              ++left_out;
            }
          }
        }
      }
      if (size.area() > 64 * 63 && window <= 11) {
        EXPECT_GT(left_out, 500);
      }
    }
  }
}

/// What the extraction looks at: it blurs the view as a whole.
int standingOutWithoutRay(const cv::Mat1f& confidence, const DsiRays& rays, int window) {
  cv::Mat1f surroundings;
  cv::GaussianBlur(confidence, surroundings, {window, window}, 0, 0, cv::BORDER_REPLICATE);
  int without = 0;
  for (int y = 0; y < confidence.rows; ++y) {
    for (int x = 0; x < confidence.cols; ++x) {
      without += confidence(y, x) > surroundings(y, x) && !rays.has({x, y}) ? 1 : 0;
    }
  }
  return without;
}

TEST_P(DsiRaysOn, AreThereWhereverTheWholeViewStandsOut) {
  for (const cv::Size& size : kSizes) {
    for (const int window : {3, 5, 11}) {
      const SweptDsi swept = sweep(stereoCase(size, 5, window), GetParam()).result.fused;
      EXPECT_EQ(standingOutWithoutRay(swept.peaks.confidence, swept.rays, window), 0)
          << size.width << " x " << size.height << ", window " << window;
    }
  }
}

/// The rays of an image of confidences on a single plane, picked in tiles.
DsiRays pickInTiles(const cv::Mat1f& confidence, int window) {
  std::vector<DsiRays::Tile> rays;
  for (const cv::Rect& tile : tilesOf({confidence.cols, confidence.rows, 1, 1, 0, 0}, 63)) {
    const cv::Mat1f part = confidence(tile);
    PlaneValues values;
    for (int y = 0; y < part.rows; ++y) values.insert(values.end(), part[y], part[y] + part.cols);
    TileVolume volume(1, values.size());
    volume.take(0, values);
    rays.push_back(DsiRays::pick(tile, part, volume, 1, window));
  }
  return DsiRays(confidence.size(), 1, std::move(rays));
}

TEST(DsiRays, HowABlurIsRoundedLosesNoPixelThatStandsOut) {
  // Slopes are their own surroundings: rounding alone decides, and not alike in tiles and in whole.
  for (const int window : {3, 5, 7, 11, 31}) {
    for (const float slope : {0.1F, 0.37F, 1e-3F}) {
      cv::Mat1f confidence(130, 171);
      for (int y = 0; y < confidence.rows; ++y) {
        for (int x = 0; x < confidence.cols; ++x) {
          confidence(y, x) = 3.3F + slope * (static_cast<float>(x) + 0.7F * static_cast<float>(y));
        }
      }
      const DsiRays rays = pickInTiles(confidence, window);
      EXPECT_EQ(standingOutWithoutRay(confidence, rays, window), 0) << window << ", " << slope;
    }
  }
}

TEST(DsiRays, AddToAddsTheWeightedRay) {
  const cv::Mat1f confidence = cv::Mat1f::ones(1, 1) * 8;
  TileVolume volume(3, 1);
  volume.take(0, {2});
  volume.take(1, {8});
  volume.take(2, {0});
  std::vector<DsiRays::Tile> tiles = {DsiRays::pick({0, 0, 1, 1}, confidence, volume, 3, 5)};
  const DsiRays rays({1, 1}, 3, std::move(tiles));
  ASSERT_TRUE(rays.has({0, 0}));
  std::vector<float> sum = {10, 20, 30};
  rays.addTo(sum.data(), {0, 0}, 0.5F);
  EXPECT_THAT(sum, ::testing::Pointwise(::testing::FloatNear(1e-4F), {11.0F, 24.0F, 30.0F}));
}

TEST(DsiRays, OfATileLieInItsPlaceOfTheView) {
  cv::Mat1f confidence = cv::Mat1f::zeros(2, 2);
  confidence(1, 0) = 5;
  TileVolume volume(1, 4);
  volume.take(0, {0, 0, 5, 0});
  std::vector<DsiRays::Tile> tiles = {DsiRays::pick({3, 1, 2, 2}, confidence, volume, 1, 3)};
  const DsiRays rays({6, 4}, 1, std::move(tiles));
  EXPECT_EQ(rays.size(), 1U);
  ASSERT_TRUE(rays.has({3, 2}));
  EXPECT_FLOAT_EQ(rays.value({3, 2}, 0), 5);
}

TEST(DsiRays, AnEmptyDsiHasNone) {
  const DsiRays rays = pickInTiles(cv::Mat1f::zeros(70, 70), 5);
  EXPECT_EQ(rays.size(), 0U);
  EXPECT_FALSE(rays.has({35, 35}));
}

}  // namespace
}  // namespace efm
