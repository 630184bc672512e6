// SPDX-License-Identifier: BSD-3-Clause
#include "maps/cloud/keyframe_cloud.h"

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
  keyframe.map.variance = cv::Mat1f::ones(2, 3);
  keyframe.map.variance(1, 2) = 0.0025F;  // sigma of depth: 4^2 * sqrt(0.0025) = 0.8
  // Quarter turn about z: (x, y, z) -> (-y, x, z); then a step of (10, 20, 30).
  keyframe.T_world_ref.rotation = Eigen::AngleAxisd(M_PI / 2, Eigen::Vector3d::UnitZ());
  keyframe.T_world_ref.translation = {10, 20, 30};

  const MapCloud::ConstPtr cloud = keyframeCloud(keyframe);

  ASSERT_EQ(cloud->size(), 1U);
  const MapPoint& point = cloud->front();
  EXPECT_NEAR(point.x, 8, 1e-5);
  EXPECT_NEAR(point.y, 22, 1e-5);
  EXPECT_NEAR(point.z, 34, 1e-5);
  EXPECT_EQ(point.intensity, 7.0F);
  EXPECT_EQ(point.support, 1U);
  EXPECT_EQ(point.sigma, 0.8F);
  keyframe.map.variance.release();
  EXPECT_TRUE(std::isnan(keyframeCloud(keyframe)->front().sigma)) << "without variances";
}

TEST(KeyframeCloud, PixelsWithoutDepthOrConfidenceGiveNoPoint) {
  KeyframeDepthMap keyframe = smallKeyframe();
  keyframe.map.depth(0, 0) = 1.0F;
  keyframe.map.depth(0, 1) = 1.0F;
  keyframe.map.confidence(0, 1) = 0.0F;

  keyframe.map.variance = cv::Mat1f::ones(2, 3);
  keyframe.map.variance(0, 0) = INFINITY;
  ASSERT_EQ(viewPoints(keyframe).size(), 1U);
  EXPECT_TRUE(std::isnan(viewPoints(keyframe)[0].sigma)) << "of a peak without curvature";
}

TEST(KeyframeCloud, LateFusionIsThePointsOfOneCameraAfterTheOther) {
  KeyframeDepthMap keyframe = smallKeyframe();
  EXPECT_TRUE(lateFusionPoints(keyframe).empty());
  keyframe.camera_maps.resize(2);
  for (int c = 0; c < 2; ++c) {
    keyframe.camera_maps[c].map = smallKeyframe().map;
    keyframe.camera_maps[c].map.depth = cv::Mat1f::zeros(2, 3);
    keyframe.camera_maps[c].map.depth(c, 2) = 2.0F + static_cast<float>(c);
  }
  const std::vector<ViewPoint> points = lateFusionPoints(keyframe);
  ASSERT_EQ(points.size(), 2U);
  EXPECT_EQ(points[0].p_ref, Eigen::Vector3f(1, 0, 2));
  EXPECT_EQ(points[1].p_ref, Eigen::Vector3f(1.5F, 1.5F, 3));
}

TEST(KeyframeCloud, ImagesOfAnotherSizeThanTheViewAreRefused) {
  for (cv::Mat1f DepthMap::*image :
       {&DepthMap::depth, &DepthMap::confidence, &DepthMap::variance}) {
    KeyframeDepthMap keyframe = smallKeyframe();
    keyframe.map.*image = cv::Mat1f::ones(3, 3);
    EXPECT_THROW(keyframeCloud(keyframe), std::invalid_argument);
  }
}

}  // namespace
}  // namespace efm
