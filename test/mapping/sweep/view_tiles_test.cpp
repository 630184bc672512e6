// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/sweep/view_tiles.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <opencv2/core.hpp>

namespace efm {
namespace {

constexpr int kMost = 63;

ReferenceView viewOf(int width, int height) { return {width, height, 1, 1, 0, 0}; }

TEST(ViewTiles, EveryPixelLiesInExactlyOneTile) {
  for (const int width : {1, 2, 62, 63, 64, 65, 126, 127, 346, 1280}) {
    for (const int height : {1, 50, 63, 64, 127, 260}) {
      cv::Mat1i tiles_of(height, width, 0);
      for (const cv::Rect& tile : tilesOf(viewOf(width, height), kMost)) {
        ASSERT_EQ(tile & cv::Rect(0, 0, width, height), tile);
        tiles_of(tile) += 1;
      }
      EXPECT_EQ(cv::countNonZero(tiles_of != 1), 0) << width << " x " << height;
    }
  }
}

TEST(ViewTiles, NoTileIsEmptyOrLargerThanAllowedAndSidesDifferByOneAtMost) {
  for (int width = 1; width <= 400; ++width) {
    const auto tiles = tilesOf(viewOf(width, 500 - width), kMost);
    const auto [narrow, wide] =
        std::minmax_element(tiles.begin(), tiles.end(),
                            [](const cv::Rect& a, const cv::Rect& b) { return a.width < b.width; });
    const auto [low, high] = std::minmax_element(
        tiles.begin(), tiles.end(),
        [](const cv::Rect& a, const cv::Rect& b) { return a.height < b.height; });
    EXPECT_GE(narrow->width, 1);
    EXPECT_LE(wide->width, std::min(kMost, narrow->width + 1));
    EXPECT_GE(low->height, 1);
    EXPECT_LE(high->height, std::min(kMost, low->height + 1));
  }
}

TEST(ViewTiles, AreAsFewAsThereCanBeAndComeRowByRow) {
  const auto tiles = tilesOf(viewOf(127, 64), kMost);
  ASSERT_EQ(tiles.size(), 6U);
  EXPECT_EQ(tiles[0], cv::Rect(0, 0, 42, 32));
  EXPECT_EQ(tiles[1], cv::Rect(42, 0, 42, 32));
  EXPECT_EQ(tiles[2], cv::Rect(84, 0, 43, 32));
  EXPECT_EQ(tiles[3], cv::Rect(0, 32, 42, 32));
  EXPECT_EQ(tilesOf(viewOf(63, 63), kMost).size(), 1U);
}

TEST(ViewTiles, TheWidestViewIsCutToItsEnd) {
  const auto tiles = tilesOf(viewOf(65'535, 2), kMost);
  EXPECT_EQ(tiles.front().x, 0);
  EXPECT_EQ(tiles.back().br(), cv::Point(65'535, 2));
}

}  // namespace
}  // namespace efm
