// SPDX-License-Identifier: BSD-3-Clause
#include <gmock/gmock.h>
#include <tbb/global_control.h>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include <cmath>
#include <random>
#include <vector>

#include "mapping/dsi/dsi_columns.h"
#include "mapping/kernels/kernels.h"
#include "mapping/sweep/space_sweep.h"
#include "test/mapping/depth/same_image.h"
#include "test/mapping/dsi/chosen_dsi.h"
#include "test/mapping/kernels/fast_kernels.h"
#include "test/mapping/rays/random_rays.h"
#include "test/mapping/sweep/sweep_case.h"

namespace efm {
namespace {

TEST(TileVolume, InterpolatesLinearlyBetweenKnownPlanes) {
  TileVolume volume(5, 3);
  volume.setPlane(0, {0, 6, 9});
  volume.setPlane(3, {3, 0, 9});
  volume.setPlane(4, {7, 7, 9});
  volume.interpolate({true, false, false, true, true}, 2);
  const float expected[5][2] = {{0, 6}, {1, 4}, {2, 2}, {3, 0}, {7, 7}};
  for (int plane = 0; plane < 5; ++plane) {
    EXPECT_FLOAT_EQ(volume.plane(plane)[0], expected[plane][0]);
    EXPECT_FLOAT_EQ(volume.plane(plane)[1], expected[plane][1]);
  }
  EXPECT_EQ(volume.plane(1)[2], 0);  // not one of the pixels
}

class RunningPeaksOn : public ::testing::TestWithParam<VotingKernel> {};

INSTANTIATE_TEST_SUITE_P(Kernels, RunningPeaksOn, ::testing::ValuesIn(availableKernels()),
                         test::nameOfKernel);

TEST_P(RunningPeaksOn, AreTheFirstLargestValueOfEachPixelAndItsNeighbours) {
  std::mt19937 random(1);
  for (int width = 1; width <= 70; ++width) {
    test::ChosenDsi dsi({width, 1}, 12);
    for (float& value : dsi.values) value = static_cast<float>(random() % 6);  // many equal values
    RunningPeaks peaks(static_cast<std::size_t>(width), GetParam());
    RunningPeaks alone(static_cast<std::size_t>(width), GetParam(), false);
    for (int plane = 0; plane < dsi.planes; ++plane) {
      peaks.add(plane, dsi.values.data() + plane * width);
      alone.add(plane, dsi.values.data() + plane * width);
    }
    DsiPeaks images = unwrittenPeaks(ReferenceView{width, 1, 1, 1, 0, 0});
    peaks.writeTo(images, {0, 0, width, 1});
    EXPECT_TRUE(test::same(images, dsi.swept().peaks)) << width << " pixels";
    EXPECT_EQ(alone.confidence(), peaks.confidence());
    EXPECT_EQ(alone.planes(), peaks.planes());
  }
}

TEST_P(RunningPeaksOn, TheKernelTouchesNoPixelsButItsOwn) {
  constexpr std::size_t kAround = 32;
  for (std::size_t n = 0; n < 40; ++n) {
    std::vector<std::vector<float>> floats(4, std::vector<float>(n + kAround, 1.0F));
    // The pixels beyond seem to have their peak on the previous plane: a wrong kernel writes them.
    std::vector<std::int32_t> plane(n + kAround, 0);
    const std::vector<float> values(n + kAround, 2.0F);
    kernels::peakFunctions(GetParam())
        .add({floats[0].data(), plane.data(), floats[1].data(), floats[2].data(), floats[3].data()},
             1, values.data(), n);
    for (std::size_t i = 0; i < n + kAround; ++i) {
      const bool own = i < n;
      ASSERT_EQ(plane[i], own ? 1 : 0) << n;
      ASSERT_EQ(floats[0][i], own ? 2 : 1) << n;
      ASSERT_EQ(floats[1][i], 1) << n;
      ASSERT_EQ(floats[2][i], own ? -1 : 1) << n;
      ASSERT_EQ(floats[3][i], own ? 2 : 1) << n;
    }
  }
}

using test::RandomRays;
using test::SweepCase;

/// Returns the error of a byte, which stores the rounded root of the distance below the peak.
float toleranceOf(float exact, float peak) {
  const float below = 1 - exact / peak;
  const float half_step = 0.5F / kernels::kMaxRoot;
  constexpr float kTable = 0.6F / 8191;
  return peak * (2 * half_step * std::sqrt(below) + half_step * half_step + kTable);
}

/// Draws two cameras with random rays in the whole view.
SweepCase stereoCase(const cv::Size& size, int planes, int window) {
  RandomRays random(static_cast<std::uint32_t>(size.area() + planes));
  SweepCase input{random.view(size), DepthPlanes({0.5, 5.0, planes, PlaneSpacing::kInverse}), {}};
  for (int camera = 0; camera < 2; ++camera) {
    input.cameras.push_back({random.bundle(input.view, input.planes, 3000)});
  }
  input.column_window = window;
  return input;
}

const std::vector<cv::Size> kSizes = {{1, 1},   {2, 2},   {1, 50},   {3, 4},    {17, 16},
                                      {63, 63}, {64, 64}, {65, 127}, {130, 66}, {190, 33}};

/// Expects that the columns are those of a swept DSI.
void expectColumnsOf(const SweptDsi& swept, const std::vector<float>& dsi, int planes) {
  const cv::Mat1f& confidence = swept.peaks.confidence;
  const DsiColumns& columns = swept.columns;
  EXPECT_EQ(columns.planes(), planes);
  std::size_t count = 0;
  for (int y = 0; y < confidence.rows; ++y) {
    for (int x = 0; x < confidence.cols; ++x) {
      if (!columns.has({x, y})) continue;
      ++count;
      for (int plane = 0; plane < planes; ++plane) {
        const float exact = dsi[static_cast<std::size_t>(plane) * confidence.total() +
                                static_cast<std::size_t>(y * confidence.cols + x)];
        ASSERT_NEAR(columns.value({x, y}, plane), exact, toleranceOf(exact, confidence(y, x)))
            << x << ", " << y << ", plane " << plane;
      }
    }
  }
  EXPECT_EQ(columns.size(), count);
}

/// Returns whether two DSIs have the same columns with the same bits.
bool sameColumns(const SweptDsi& a, const SweptDsi& b) {
  const cv::Size size = a.peaks.confidence.size();
  for (int y = 0; y < size.height; ++y) {
    for (int x = 0; x < size.width; ++x) {
      if (a.columns.has({x, y}) != b.columns.has({x, y})) return false;
      if (!a.columns.has({x, y})) continue;
      for (int plane = 0; plane < a.columns.planes(); ++plane) {
        if (a.columns.value({x, y}, plane) != b.columns.value({x, y}, plane)) return false;
      }
    }
  }
  return true;
}

class DsiColumnsOn : public ::testing::TestWithParam<VotingKernel> {};

INSTANTIATE_TEST_SUITE_P(Kernels, DsiColumnsOn, ::testing::ValuesIn(availableKernels()),
                         test::nameOfKernel);

TEST_P(DsiColumnsOn, EveryColumnIsTheDsiWithinAByteForAnyNumberOfThreads) {
  const tbb::global_control as_if_eight_cores(tbb::global_control::max_allowed_parallelism, 8);
  for (const cv::Size& size : kSizes) {
    for (const int planes : {1, 2, 9, 500}) {
      if (planes == 500 && size.width != 65) continue;
      SCOPED_TRACE(testing::Message() << size << ", " << planes << " planes");
      const test::SweepOutput one = sweep(stereoCase(size, planes, 5), GetParam(), 1);
      expectColumnsOf(one.result.fused, one.dsi, planes);
      const test::SweepOutput many = sweep(stereoCase(size, planes, 5), GetParam(), 8);
      EXPECT_TRUE(sameColumns(one.result.fused, many.result.fused));
    }
  }
}

TEST_P(DsiColumnsOn, OfEachCameraAreThoseOfItsOwnSweep) {
  SweepCase input = stereoCase({80, 70}, 9, 5);
  const test::SweepOutput all = sweep(input, GetParam(), 2);
  ASSERT_EQ(all.result.cameras.size(), 2U);
  for (std::size_t c = 0; c < 2; ++c) {
    SweepCase one = input;
    one.cameras = {input.cameras[c]};
    EXPECT_GT(all.result.cameras[c].columns.size(), 100U);
    EXPECT_TRUE(sameColumns(all.result.cameras[c], sweep(one, GetParam(), 1).result.fused));
  }
}

TEST_P(DsiColumnsOn, WithoutThemTheSweepHasPeaksWithTheirNeighboursAndTheSameConfidence) {
  for (const int planes : {1, 2, 3, 9}) {
    SweepCase input = stereoCase({80, 70}, planes, 5);
    const test::SweepOutput with = sweep(input, GetParam());
    input.column_window = 0;
    const test::SweepOutput without = sweep(input, GetParam());
    EXPECT_GT(with.result.fused.columns.size(), 100U);
    EXPECT_EQ(without.result.fused.columns.size(), 0U);
    const DsiPeaks& peaks = with.result.fused.peaks;
    EXPECT_TRUE(test::same(peaks.confidence, without.result.fused.peaks.confidence));
    EXPECT_TRUE(peaks.plane.empty() && peaks.before.empty() && peaks.after.empty());
    test::ChosenDsi dsi({80, 70}, planes);
    dsi.values = without.dsi;
    EXPECT_TRUE(test::same(without.result.fused.peaks, dsi.swept().peaks)) << planes;
  }
}

/// Returns the Gaussian mean around each pixel of the whole view.
cv::Mat1f surroundingsOf(const cv::Mat1f& confidence, int window) {
  cv::Mat1f surroundings;
  cv::GaussianBlur(confidence, surroundings, {window, window}, 0, 0, cv::BORDER_REPLICATE);
  return surroundings;
}

/// Returns the number of pixels above their surroundings that have no column.
int standingOutWithoutColumn(const cv::Mat1f& confidence, const DsiColumns& columns, int window) {
  const cv::Mat1f surroundings = surroundingsOf(confidence, window);
  int without = 0;
  for (int y = 0; y < confidence.rows; ++y) {
    for (int x = 0; x < confidence.cols; ++x) {
      without += confidence(y, x) > surroundings(y, x) && !columns.has({x, y}) ? 1 : 0;
    }
  }
  return without;
}

TEST_P(DsiColumnsOn, AreSelectedAboveTheSurroundingsAndEverywhereAtTheEdgesOfTiles) {
  constexpr double kRounding = 1e-4;  // fraction of the mean: rounding decides
  for (const int window : {3, 5, 11, 63, 255}) {
    for (const cv::Size& size : {cv::Size(4, 3), {64, 64}, {150, 70}}) {
      const SweepCase input = stereoCase(size, 3, window);
      const SweptDsi swept = sweep(input, GetParam()).result.fused;
      const cv::Mat1f& confidence = swept.peaks.confidence;
      EXPECT_EQ(standingOutWithoutColumn(confidence, swept.columns, window), 0);
      const cv::Mat1f surroundings = surroundingsOf(confidence, window);
      const std::vector<cv::Rect> tiles =
          GetParam() == VotingKernel::kPlain
              ? std::vector<cv::Rect>{{0, 0, size.width, size.height}}
              : tilesOf(input.view, 63);
      int left_out = 0;
      for (const cv::Rect& tile : tiles) {
        const int radius = window / 2;
        const cv::Rect inner(tile.x + radius, tile.y + radius, tile.width - 2 * radius,
                             tile.height - 2 * radius);
        for (int y = tile.y; y < tile.br().y; ++y) {
          for (int x = tile.x; x < tile.br().x; ++x) {
            if (!inner.contains({x, y})) {
              ASSERT_EQ(swept.columns.has({x, y}), confidence(y, x) > 0) << x << ", " << y;
            } else if (confidence(y, x) < (1 - kRounding) * surroundings(y, x)) {
              ASSERT_FALSE(swept.columns.has({x, y})) << x << ", " << y;
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

/// Returns the columns of an image of confidences on a single plane, selected in tiles.
DsiColumns selectInTiles(const cv::Mat1f& confidence, int window) {
  std::vector<DsiColumns::Tile> columns;
  for (const cv::Rect& tile : tilesOf({confidence.cols, confidence.rows, 1, 1, 0, 0}, 63)) {
    const cv::Mat1f part = confidence(tile);
    PlaneValues values;
    for (int y = 0; y < part.rows; ++y) values.insert(values.end(), part[y], part[y] + part.cols);
    TileVolume volume(1, values.size());
    volume.setPlane(0, values);
    columns.push_back(DsiColumns::select(tile, part, volume, 1, window));
  }
  return DsiColumns(confidence.size(), 1, std::move(columns));
}

TEST(DsiColumns, HowABlurIsRoundedLosesNoPixelThatStandsOut) {
  // The surroundings of a pixel in a gradient have its value: only rounding decides, and it differs
  // between tiles and the whole image.
  for (const int window : {3, 5, 7, 11, 31}) {
    for (const float gradient : {0.1F, 0.37F, 1e-3F}) {
      cv::Mat1f confidence(130, 171);
      for (int y = 0; y < confidence.rows; ++y) {
        for (int x = 0; x < confidence.cols; ++x) {
          confidence(y, x) =
              3.3F + gradient * (static_cast<float>(x) + 0.7F * static_cast<float>(y));
        }
      }
      const DsiColumns columns = selectInTiles(confidence, window);
      EXPECT_EQ(standingOutWithoutColumn(confidence, columns, window), 0)
          << window << ", " << gradient;
    }
  }
}

}  // namespace

}  // namespace efm
