// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/pictures/depth_picture.h"

#include <gtest/gtest.h>

namespace efm {
namespace {

TEST(DepthPicture, RunsFromRedNearToBlueFarOnWhite) {
  const cv::Mat1f depth = (cv::Mat1f(1, 3) << 1, 4, 0);
  const cv::Mat3b picture = depthPicture(depth, {1.0, 4.0, 10, PlaneSpacing::kInverse});
  const cv::Vec3b near_bgr = picture(0, 0);
  const cv::Vec3b far_bgr = picture(0, 1);
  EXPECT_GT(near_bgr[2], 100);
  EXPECT_EQ(near_bgr[0], 0);
  EXPECT_GT(far_bgr[0], 100);
  EXPECT_EQ(far_bgr[2], 0);
  EXPECT_EQ(picture(0, 2), cv::Vec3b(255, 255, 255));
}

TEST(DepthPicture, MiddleOfInverseDepthIsGreen) {
  // 1/1.6 is half way between 1/1 and 1/4.
  const cv::Vec3b bgr = depthPicture((cv::Mat1f(1, 1) << 1.6F), {1.0, 4.0, 10})(0, 0);
  EXPECT_GT(bgr[1], 200);
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
