// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/motion/event_contrast.h"

#include <gtest/gtest.h>

namespace efm::nearest_depths_test {
namespace {

TEST(NearestDepths, EachPixelHasTheDepthOfTheNearestWithinTheRadius) {
  cv::Mat1f depth = cv::Mat1f::zeros(20, 30);
  depth(10, 5) = 2;
  depth(10, 11) = 4;
  const NearestDepths depths(depth, 4);
  EXPECT_FALSE(depths.empty());
  EXPECT_EQ(depths.inverseDepth({5, 10}), 0.5F);
  EXPECT_EQ(depths.distancePx({5, 10}), 0);
  EXPECT_EQ(depths.inverseDepth({7, 10}), 0.5F);
  EXPECT_EQ(depths.distancePx({7, 10}), 2);
  EXPECT_EQ(depths.inverseDepth({9, 10}), 0.25F);
  EXPECT_EQ(depths.inverseDepth({15, 10}), 0.25F);
  EXPECT_EQ(depths.inverseDepth({16, 10}), 0);
  EXPECT_EQ(depths.inverseDepth({5, 16}), 0);
}

TEST(NearestDepths, WithoutADepthThereIsNone) {
  const NearestDepths depths(cv::Mat1f::zeros(6, 7), 4);
  EXPECT_TRUE(depths.empty());
  EXPECT_EQ(depths.inverseDepth({3, 3}), 0);
}

}  // namespace
}  // namespace efm::nearest_depths_test
