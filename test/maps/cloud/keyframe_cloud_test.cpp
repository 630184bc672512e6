// SPDX-License-Identifier: BSD-3-Clause
#include "maps/cloud/keyframe_cloud.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace efm {
namespace {

/// A view of 3 x 2 pixels, f = 2, principal point (1, 0), without any depth.
KeyframeDepthMap smallKeyframe() {
  KeyframeDepthMap keyframe;
  keyframe.view = {3, 2, 2.0, 2.0, 1.0, 0.0};
  keyframe.map.depth = cv::Mat1f::zeros(2, 3);
  keyframe.map.confidence = cv::Mat1f::ones(2, 3);
  return keyframe;
}

TEST(KeyframeCloud, PointOfAPixelIsWorkedOutByHand) {
  KeyframeDepthMap keyframe = smallKeyframe();
  keyframe.map.depth(1, 2) = 4.0F;  // p_ref = ((2-1)/2*4, (1-0)/2*4, 4) = (2, 2, 4)
  keyframe.map.confidence(1, 2) = 7.0F;
  // Quarter turn about z: (x, y, z) -> (-y, x, z); then a step of (10, 20, 30).
  keyframe.T_world_ref.rotation = Eigen::AngleAxisd(M_PI / 2, Eigen::Vector3d::UnitZ());
  keyframe.T_world_ref.translation = {10, 20, 30};

  const std::vector<CloudPoint> points = keyframeCloud(keyframe);

  ASSERT_EQ(points.size(), 1U);
  EXPECT_NEAR(points[0].p_world.x(), 8, 1e-12);
  EXPECT_NEAR(points[0].p_world.y(), 22, 1e-12);
  EXPECT_NEAR(points[0].p_world.z(), 34, 1e-12);
  EXPECT_EQ(points[0].confidence, 7.0F);
  EXPECT_EQ(points[0].support, 1U);
}

TEST(KeyframeCloud, IsThePointsOfTheViewPlacedInTheWorld) {
  KeyframeDepthMap keyframe = smallKeyframe();
  keyframe.map.depth = 1.1F;
  keyframe.view.fx = 2.3;  // no coordinate is a float
  keyframe.T_world_ref.rotation = Eigen::AngleAxisd(1, Eigen::Vector3d(1, 2, 3).normalized());
  keyframe.T_world_ref.translation = {1e5, 2e5, 3e5};

  const std::vector<ViewPoint> seen = viewPoints(keyframe);
  const std::vector<CloudPoint> points = keyframeCloud(keyframe);

  ASSERT_EQ(points.size(), 6U);
  const std::vector<CloudPoint> placed = pointsInWorld(seen, keyframe.T_world_ref);
  for (std::size_t i = 0; i < 6; ++i) {
    EXPECT_EQ(points[i].p_world, placed[i].p_world) << "bit for bit";
    EXPECT_EQ(points[i].confidence, seen[i].confidence);
  }
}

TEST(KeyframeCloud, PixelsWithoutDepthOrConfidenceGiveNoPoint) {
  KeyframeDepthMap keyframe = smallKeyframe();
  keyframe.map.depth(0, 0) = 1.0F;
  keyframe.map.depth(0, 1) = 1.0F;
  keyframe.map.confidence(0, 1) = 0.0F;

  EXPECT_EQ(keyframeCloud(keyframe).size(), 1U);
}

TEST(KeyframeCloud, ImagesOfAnotherSizeThanTheViewAreRefused) {
  KeyframeDepthMap keyframe = smallKeyframe();
  keyframe.map.confidence = cv::Mat1f::ones(3, 3);

  EXPECT_THROW(keyframeCloud(keyframe), std::invalid_argument);
}

}  // namespace
}  // namespace efm
