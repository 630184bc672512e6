// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/dsi/dsi_columns.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <string>
#include <vector>

#include "mapping/kernels/kernels.h"
#include "test/mapping/depth/same_image.h"

namespace efm {
namespace {

using Planes = std::vector<PlaneValues>;

/// Small whole numbers, so that many planes tie.
Planes randomPlanes(std::mt19937& random, int planes, std::size_t pixels) {
  Planes values(static_cast<std::size_t>(planes), PlaneValues(pixels));
  for (auto& plane : values) {
    for (float& value : plane) value = static_cast<float>(random() % 6);
  }
  return values;
}

/// The peaks of whole columns.
DsiPeaks peaksOf(const Planes& planes, const ReferenceView& view) {
  DsiPeaks peaks = unwrittenPeaks(view);
  const std::size_t last = planes.size() - 1;
  for (std::size_t i = 0; i < view.pixels(); ++i) {
    std::size_t best = 0;
    for (std::size_t p = 1; p <= last; ++p) {
      if (planes[p][i] > planes[best][i]) best = p;
    }
    const auto pixel = static_cast<int>(i);
    peaks.confidence(pixel / view.width, pixel % view.width) = planes[best][i];
    peaks.plane(pixel / view.width, pixel % view.width) = static_cast<int>(best);
    peaks.before(pixel / view.width, pixel % view.width) = best > 0 ? planes[best - 1][i] : -1;
    peaks.after(pixel / view.width, pixel % view.width) = best < last ? planes[best + 1][i] : -1;
  }
  return peaks;
}

ReferenceView viewOf(int width, int height) {
  ReferenceView view;
  view.width = width;
  view.height = height;
  return view;
}

class RunningPeaksOn : public ::testing::TestWithParam<VotingKernel> {};

INSTANTIATE_TEST_SUITE_P(Kernels, RunningPeaksOn, ::testing::ValuesIn(availableKernels()),
                         [](const auto& test) { return std::string(nameOf(test.param)); });

TEST_P(RunningPeaksOn, AreTheFirstLargestValueOfEachPixelAndItsNeighbours) {
  std::mt19937 random(1);
  for (int width = 1; width <= 70; ++width) {
    const ReferenceView view = viewOf(width, 1);
    const Planes planes = randomPlanes(random, 12, view.pixels());
    RunningPeaks peaks(view.pixels(), GetParam());
    for (std::size_t p = 0; p < planes.size(); ++p) peaks.add(static_cast<int>(p), planes[p]);
    DsiPeaks images = unwrittenPeaks(view);
    peaks.writeTo(images, {0, 0, width, 1});
    EXPECT_TRUE(test::same(images, peaksOf(planes, view))) << width << " pixels";
  }
}

TEST_P(RunningPeaksOn, TilesFillTheView) {
  std::mt19937 random(3);
  const ReferenceView view = viewOf(41, 23);
  const Planes planes = randomPlanes(random, 9, view.pixels());
  DsiPeaks images = unwrittenPeaks(view);
  constexpr int kSide = 17;
  for (int y = 0; y < view.height; y += kSide) {
    for (int x = 0; x < view.width; x += kSide) {
      const cv::Rect tile = cv::Rect(x, y, kSide, kSide) & cv::Rect(0, 0, view.width, view.height);
      RunningPeaks peaks(static_cast<std::size_t>(tile.area()), GetParam());
      for (std::size_t p = 0; p < planes.size(); ++p) {
        PlaneValues values;
        for (int row = tile.y; row < tile.br().y; ++row) {
          const auto begin = planes[p].begin() + row * view.width + tile.x;
          values.insert(values.end(), begin, begin + tile.width);
        }
        peaks.add(static_cast<int>(p), values);
      }
      peaks.writeTo(images, tile);
    }
  }
  EXPECT_TRUE(test::same(images, peaksOf(planes, view)));
}

TEST_P(RunningPeaksOn, TheKernelTouchesNoPixelsButItsOwn) {
  constexpr std::size_t kAround = 32;
  for (std::size_t n = 0; n < 40; ++n) {
    std::vector<std::vector<float>> floats(4, std::vector<float>(n + kAround, 1.0F));
    // As if the pixels beyond had their peak on the plane before: they would be written.
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

}  // namespace
}  // namespace efm
