// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/results/pictures/depth_picture.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <utility>
#include <vector>

#include "plugin/results/pictures/picture.h"

namespace efm {
namespace {

TEST(DepthPicture, RunsFromRedNearToBlueFarOnWhite) {
  const cv::Mat1f depth = (cv::Mat1f(1, 4) << 1, 4, 0, 1.6F);  // 1/1.6 is half way
  const cv::Mat3b picture = depthPicture(depth, {1.0, 4.0, 10, PlaneSpacing::kInverse});
  const cv::Vec3b near_bgr = picture(0, 0);
  const cv::Vec3b far_bgr = picture(0, 1);
  EXPECT_GT(near_bgr[2], 100);
  EXPECT_EQ(near_bgr[0], 0);
  EXPECT_GT(far_bgr[0], 100);
  EXPECT_EQ(far_bgr[2], 0);
  EXPECT_EQ(picture(0, 2), cv::Vec3b(255, 255, 255));
  EXPECT_GT(picture(0, 3)[1], 200) << "green";
}

double lightness(const cv::Vec3b& bgr) { return 0.114 * bgr[0] + 0.587 * bgr[1] + 0.299 * bgr[2]; }

/// In grey print depths must differ from each other and from the paper.
TEST(DepthFigure, IsReadableInGreyAndShowsTheConfidenceWithoutDepth) {
  DepthMap map;
  map.depth = cv::Mat1f::zeros(180, 240);
  map.confidence = cv::Mat1f::zeros(180, 240);
  const float depths[] = {1, 1.2F, 1.6F, 2.5F, 4};
  for (int k = 0; k < 5; ++k) map.depth(100, 20 * k) = depths[k];
  map.confidence(100, 200) = 9;
  const cv::Mat3b figure = depthFigure(map, {1.0, 4.0, 10, PlaneSpacing::kInverse});
  ASSERT_EQ(figure.cols, 3 * 240) << "a whole factor";
  ASSERT_GT(figure.rows, 3 * 180) << "the bar";
  double lighter = 215;  // white is 255
  for (int k = 0; k < 5; ++k) {
    const double light = lightness(figure(301, 3 * 20 * k + 1));
    EXPECT_LT(light, lighter - 10) << depths[k];
    lighter = light;
  }
  const cv::Vec3b grey = figure(301, 601);
  EXPECT_EQ(grey[0], grey[2]);
  EXPECT_LT(grey[0], 255);
  EXPECT_EQ(figure(301, 631), cv::Vec3b(255, 255, 255));
  map.depth = cv::Mat1f::zeros(720, 1280);
  map.confidence = cv::Mat1f::zeros(720, 1280);
  EXPECT_EQ(depthFigure(map, {1.0, 4.0, 10}).cols, 1280) << "not enlarged";
}

/// Its first and its last colour from left to right.
std::pair<cv::Vec3b, cv::Vec3b> endsOf(const cv::Mat3b& bar) {
  std::vector<cv::Vec3b> colours;
  for (int x = 0; x < bar.cols; ++x) {
    for (int y = 0; y < bar.rows; ++y) {
      const cv::Vec3b& pixel = bar(y, x);
      const auto [low, high] = std::minmax({pixel[0], pixel[1], pixel[2]});
      if (high - low > 60) colours.push_back(pixel);  // neither paper nor ink
    }
  }
  return {colours.at(0), colours.back()};
}

TEST(ColourBar, RunsFromTheColourOfItsLowEndToThatOfItsHighEnd) {
  for (const Palette palette : {Palette::kRainbow, Palette::kBlueToRed}) {
    const cv::Mat3b ends = coloured((cv::Mat1b(1, 2) << 0, 255), palette);
    const auto [first, last] = endsOf(drawBar({2, 8}, palette, "m", 400));
    EXPECT_LT(cv::norm(first, ends(0, 0)), 12);
    EXPECT_LT(cv::norm(last, ends(0, 1)), 12);
    // The same colours as the image beside it.
    const cv::Mat3b picture =
        drawValues({"", (cv::Mat1f(1, 2) << 2, 8), {2, 8}, "m", palette, 320});
    EXPECT_LT(cv::norm(picture(80, 80), ends(0, 0)), 12);
    EXPECT_LT(cv::norm(picture(80, 240), ends(0, 1)), 12);
  }
}

TEST(ConfidencePicture, IsBrightWhereSmallAndDarkWhereLarge) {
  const cv::Mat1b picture = confidencePicture((cv::Mat1f(1, 3) << 0, 5, 10));
  EXPECT_EQ(picture(0, 0), 255);
  EXPECT_NEAR(picture(0, 1), 128, 1);
  EXPECT_EQ(picture(0, 2), 0);
  EXPECT_EQ(confidencePicture(cv::Mat1f::zeros(1, 1))(0, 0), 255);
}

TEST(EventPicture, BrighterIsRedDarkerBlueAndStrongerDarker) {
  cv::Mat_<cv::Vec2i> counts(1, 4);  // darker, brighter
  counts << cv::Vec2i(0, 1), cv::Vec2i(1, 0), cv::Vec2i(0, 3), cv::Vec2i(0, 0);
  const cv::Mat3b picture = eventPicture(counts);
  EXPECT_EQ(picture(0, 0), cv::Vec3b(120, 120, 255));
  EXPECT_EQ(picture(0, 1), cv::Vec3b(255, 120, 120));
  EXPECT_EQ(picture(0, 2), cv::Vec3b(0, 0, 255));
  EXPECT_EQ(picture(0, 3), cv::Vec3b(255, 255, 255));
}

}  // namespace
}  // namespace efm
