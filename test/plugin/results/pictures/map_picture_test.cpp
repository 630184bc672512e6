// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/results/pictures/map_picture.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <opencv2/imgproc.hpp>

#include "mapping/geometry/rigid3.h"
#include "plugin/results/pictures/depth_picture.h"
#include "plugin/results/pictures/picture.h"
#include "test/plugin/results/pictures/sketch.h"

namespace efm {
namespace {

constexpr double kVoxel = 0.01;  // metres

/// Cameras that look along +y of a world with z up, on a line along x.
std::vector<StampedPose> lookingAlongY(int count) {
  Eigen::Matrix3d R_world_cam;  // columns: x right, y down, z forward
  R_world_cam << 1, 0, 0,       //
      0, 0, 1,                  //
      0, -1, 0;
  std::vector<StampedPose> trajectory;
  for (int i = 0; i < count; ++i) {
    trajectory.push_back({i, {Eigen::Quaterniond(R_world_cam), {0.1 * i, 0, 0}}});
  }
  return trajectory;
}

/// A box of points: 4 m along x, 2 m along y, 1 m high.
std::vector<CloudPoint> box() {
  std::vector<CloudPoint> points;
  for (int x = 0; x <= 40; ++x) {
    for (int y = 0; y <= 20; ++y) {
      for (int z = 0; z <= 10; ++z) points.push_back({{0.1 * x, 1 + 0.1 * y, 0.1 * z}, 1.0F});
    }
  }
  return points;
}

TEST(Upward, IsAcrossTheLevelAxesOfTheCameras) {
  EXPECT_LT((upwardOf(lookingAlongY(5)) - Eigen::Vector3d::UnitZ()).norm(), 1e-9);
  EXPECT_EQ(upwardOf({}), Eigen::Vector3d::UnitZ());
  // The pinhole convention: a world that is the first camera's frame has y down.
  EXPECT_LT((upwardOf({{0, Rigid3{}}, {1, Rigid3{}}}) + Eigen::Vector3d::UnitY()).norm(), 1e-9);
}

TEST(MapLayout, FarOutliersDoNotChangeTheScale) {
  std::vector<CloudPoint> points = box();
  const MapLayout without = layOutMap(*mapCloudOf(points, kVoxel), lookingAlongY(3));
  for (int i = 0; i < 20; ++i) points.push_back({{500, -300, 100}, 1.0F});
  const MapLayout with = layOutMap(*mapCloudOf(points, kVoxel), lookingAlongY(3));
  EXPECT_NEAR(with.top.pixels_per_m, without.top.pixels_per_m, 0.1 * without.top.pixels_per_m);
}

TEST(MapPicture, HasTheMapFromAboveAndFromTheSideTheTrajectoryAndALegend) {
  // Cameras that go right and look at a box, of which the picture has a corner missing.
  std::vector<CloudPoint> points = box();
  points.erase(std::remove_if(points.begin(), points.end(),
                              [](const CloudPoint& point) {
                                return point.p_world.x() > 3 && point.p_world.y() > 2;
                              }),
               points.end());
  const auto trajectory = lookingAlongY(15);
  const cv::Mat3b picture = drawMap(*mapCloudOf(points, kVoxel), trajectory, kVoxel);
  EXPECT_LE(std::max(picture.rows, picture.cols), 1500);
  EXPECT_EQ(test::sketchOf(picture, 75), R"(
y
yyyyyyyyyyyyy
yyyyyyyyyyyyy
yyyyyyyyyyyyy
yyyyyyyyyyyyy
yyyyyyyyyyyyyyyyyy
yyyyyyyyyyyyyyyyyy
yyyyyyyyyyyyyyyyyy
yyyyyyyyyyyyyyyyyy




+ +
+
rrrrrrrrrrrrrrrrrr
yyyyyyyyyyyyyyyyyy
cccccccccccccccccc
cccbbbbbbbbbbbbbbb
##  +     bccgyyrr
174531 px at 640.8, 795.6
)");
  // The same in a world with y down, and where cameras look back.
  for (const Eigen::Vector3d& turn : {Eigen::Vector3d(0.5 * kPi, 0, 0), {0, 0, kPi}}) {
    const Rigid3 T_other_world{rotationBy(turn), {0, 0, 0}};
    std::vector<CloudPoint> other = points;
    for (CloudPoint& point : other) point.p_world = T_other_world * point.p_world;
    std::vector<StampedPose> there = trajectory;
    for (StampedPose& pose : there) pose.T_world_rig = T_other_world * pose.T_world_rig;
    const cv::Mat3b turned = drawMap(*mapCloudOf(other, kVoxel), there, kVoxel);
    ASSERT_EQ(turned.size(), picture.size());
    const cv::Mat difference = cv::Mat(turned != picture).reshape(1);
    EXPECT_LT(cv::countNonZero(difference), 0.01 * static_cast<double>(difference.total()));
  }
  // A trajectory alone, and a single point.
  EXPECT_EQ(test::sketchOf(drawMap(MapCloud(), trajectory, kVoxel), 100), R"(
+


## +
21382 px at 656.3, 182.3
)");
  EXPECT_EQ(test::sketchOf(
                drawMap(*mapCloudOf({{{1, 2, 3}, 1.0F}}, kVoxel), lookingAlongY(1), kVoxel), 100),
            R"(














   + cyr
12763 px at 461.6, 1001.8
)");
  EXPECT_THROW(drawMap(MapCloud(), {}, kVoxel), std::invalid_argument);
}

TEST(KeyframeSheet, ShowsTwelveOfAnyNumberEvenly) {
  const DepthPlanesOptions limits{1, 5, 30, PlaneSpacing::kInverse};
  KeyframeSheet sheet;
  EXPECT_THROW(sheet.draw(limits), std::logic_error);
  const cv::Mat1f first(30, 40, 1.0F);
  sheet.add(0, first);
  for (int i = 1; i < 5; ++i) sheet.add(i, cv::Mat1f(30, 40, 1.0F + static_cast<float>(i)));
  EXPECT_EQ(test::sketchOf(sheet.draw(limits), 100), R"(
yyyyymmmmmmmmmm
yyyyymmmmmmmmmm
yyyyymmmmmmmmmm
yyyyymmmmmmmmmm
bbbbbbbbbb
bbbbbbbbbb
bbbbbbbbbb
bbbbmbbbbbb
    yrrmmmb
878441 px at 631.1, 341.9
)");
  for (int i = 5; i < 1000; ++i) {
    sheet.add(i, cv::Mat1f(30, 40, 1 / (1 - 0.0008F * static_cast<float>(i))));
  }
  EXPECT_EQ(test::sketchOf(sheet.draw(limits), 100), R"(
yyyyyyyrrrrrrrr
yyyyyyyrrrrrrrr
yyyyyyyrrrrrrrr
rrrrrrrmmmmmmmm
rrrrrrrmmmmmmmm
rrrrrrrmmmmmmmm
mmmmmmmbbbbbbbb
mmmmmmmbbbbbbbb
mmmmmmmbbbbbbbb
    yrrmmmb
1182682 px at 731.1, 438.2
)");
  EXPECT_EQ(cv::countNonZero(first != 1), 0) << "the caller's depth map is as it was";
}

}  // namespace
}  // namespace efm
