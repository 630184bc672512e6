// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>
#include <opencv2/imgproc.hpp>

#include <algorithm>
#include <utility>
#include <vector>

#include "mapping/geometry/rigid3.h"
#include "plugin/results/pictures/depth_picture.h"
#include "plugin/results/pictures/map_picture.h"
#include "plugin/results/pictures/picture.h"
#include "test/plugin/results/pictures/sketch.h"

namespace efm {
namespace {

/// Returns relative luminance as in sRGB, but linear: sufficient to compare lightness.
double lightness(const PointColour& colour) {
  return 0.2126 * colour[0] + 0.7152 * colour[1] + 0.0722 * colour[2];
}

TEST(ColoursByHeight, HigherIsBrighterAndOutliersDoNotWidenTheRange) {
  // 101 points along -y, which is up; then also an outlier far below and an outlier far above.
  std::vector<CloudPoint> points;
  for (int i = 0; i <= 100; ++i) points.push_back({{5.0 * i, -0.1 * i, 1}, 1, 1});
  const auto colours = coloursByHeight(*mapCloudOf(points, 0.01), -Eigen::Vector3d::UnitY());
  ASSERT_EQ(colours.size(), points.size());
  for (std::size_t i = 10; i <= 100; i += 10) {
    EXPECT_GT(lightness(colours[i]), lightness(colours[i - 10]) + 5) << i;
  }
  EXPECT_GT(colours[0][2], colours[0][0]) << "the low end is blue";
  EXPECT_LT(colours[100][2], colours[100][0]) << "the high end is yellow";

  points.push_back({{0, 1000, 0}, 1, 1});
  points.push_back({{0, -1000, 0}, 1, 1});
  const auto with_outliers = coloursByHeight(*mapCloudOf(points, 0.01), -Eigen::Vector3d::UnitY());
  EXPECT_EQ(with_outliers[101], colours[0]);
  EXPECT_EQ(with_outliers[102], colours[100]);
  EXPECT_EQ(with_outliers[50], colours[50]);
  EXPECT_TRUE(coloursByHeight(MapCloud(), Eigen::Vector3d::UnitZ()).empty());
  const std::vector<CloudPoint> flat(3, {{1, 2, 3}, 1, 1});
  EXPECT_EQ(coloursByHeight(*mapCloudOf(flat, 0.01), Eigen::Vector3d::UnitZ()).size(), 3U);
}

TEST(DepthPicture, RunsFromRedNearToBlueFarOnWhite) {
  const cv::Mat1f depth = (cv::Mat1f(1, 4) << 1, 4, 0, 1.6F);  // 1/1.6 is halfway
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

/// In grey print, depths must differ from each other and from the paper.
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

/// Returns the first and the last colour from left to right.
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
    // The bar has the colours of the image beside it.
    const cv::Mat3b picture = drawValues({(cv::Mat1f(1, 2) << 2, 8), {2, 8}, "m", palette, 320});
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
  cv::Mat_<cv::Vec2i> counts(1, 4);  // counts of darker, brighter events
  counts << cv::Vec2i(0, 1), cv::Vec2i(1, 0), cv::Vec2i(0, 3), cv::Vec2i(0, 0);
  const cv::Mat3b picture = eventPicture(counts);
  EXPECT_EQ(picture(0, 0), cv::Vec3b(120, 120, 255));
  EXPECT_EQ(picture(0, 1), cv::Vec3b(255, 120, 120));
  EXPECT_EQ(picture(0, 2), cv::Vec3b(0, 0, 255));
  EXPECT_EQ(picture(0, 3), cv::Vec3b(255, 255, 255));
}

constexpr double kVoxel = 0.01;  // metres

/// Returns cameras on a line along x. They look along +y in a world with z up.
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

/// Returns a box of points: 4 m along x, 2 m along y, 1 m high.
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
  // In the pinhole convention, a world that is the first camera's frame has y down.
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
  // The cameras move right and look at a box. A corner of the box is missing in the map.
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
##+       bccgyyrr
174531 px at 639.6, 795.7
)");
  // The picture is the same in a world with y down, and in a world rotated by 180 degrees about z.
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
  // A trajectory without points, and a single point.
  EXPECT_EQ(test::sketchOf(drawMap(MapCloud(), trajectory, kVoxel), 100), R"(
+


##
21382 px at 647.1, 182.7
)");
  EXPECT_EQ(test::sketchOf(
                drawMap(*mapCloudOf({{{1, 2, 3}, 1.0F}}, kVoxel), lookingAlongY(1), kVoxel), 100),
            R"(














#    cyr
12763 px at 444.2, 1002.3
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
rrrrmmmmmmmmmmm
mmmmmmmbbbbbbbb
mmmmmmmbbbbbbbb
mmmmmmmbbbbbbbb
    yrrmmmb
1182678 px at 731.1, 438.2
)");
  EXPECT_EQ(cv::countNonZero(first != 1), 0) << "the caller's depth map is as it was";
}

}  // namespace

}  // namespace efm
