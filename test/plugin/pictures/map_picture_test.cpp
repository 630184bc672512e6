// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/pictures/map_picture.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <opencv2/imgproc.hpp>
#include <utility>

#include "plugin/pictures/keyframe_sheet.h"
#include "plugin/pictures/map_layout.h"
#include "plugin/pictures/upward.h"

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

/// Where a picture is neither white nor grey.
cv::Mat1b colouredIn(const cv::Mat3b& picture) {
  cv::Mat1b mask(picture.size());
  std::transform(picture.begin(), picture.end(), mask.begin(), [](const cv::Vec3b& pixel) {
    const auto [low, high] = std::minmax({pixel[0], pixel[1], pixel[2]});
    return high - low > 40 ? uchar{255} : uchar{0};
  });
  return mask;
}

TEST(Upward, IsAcrossTheLevelAxesOfTheCameras) {
  EXPECT_LT((upwardOf(lookingAlongY(5)) - Eigen::Vector3d::UnitZ()).norm(), 1e-9);
  EXPECT_EQ(upwardOf({}), Eigen::Vector3d::UnitZ());
  // The pinhole convention: a world that is the first camera's frame has y down.
  EXPECT_LT((upwardOf({{0, Rigid3{}}, {1, Rigid3{}}}) + Eigen::Vector3d::UnitY()).norm(), 1e-9);
}

TEST(MapLayout, BothViewsHaveOneScaleAndShowTheMap) {
  const auto trajectory = lookingAlongY(3);
  const MapLayout layout = layOutMap(*mapCloudOf(box(), kVoxel), trajectory);
  EXPECT_EQ(layout.top.pixels_per_m, layout.side.pixels_per_m);
  const Eigen::Vector3d a(0.5, 1.5, 0.2);
  const Eigen::Vector3d b(3.5, 1.5, 0.2);
  for (const MapView* view : {&layout.top, &layout.side}) {
    EXPECT_TRUE(view->area.contains(view->pixelOf(a)));
    EXPECT_TRUE(view->area.contains(view->pixelOf(b)));
    EXPECT_NEAR(view->right.dot(view->upwards), 0, 1e-9);
  }
  const cv::Point2d apart = layout.top.pixelOf(b) - layout.top.pixelOf(a);
  EXPECT_NEAR(std::hypot(apart.x, apart.y), 3 * layout.top.pixels_per_m, 1e-6);
  EXPECT_NEAR(layout.side.upwards.dot(Eigen::Vector3d::UnitZ()), 1, 1e-9);
}

TEST(MapLayout, FarOutliersDoNotChangeTheScale) {
  std::vector<CloudPoint> points = box();
  const MapLayout without = layOutMap(*mapCloudOf(points, kVoxel), lookingAlongY(3));
  for (int i = 0; i < 20; ++i) points.push_back({{500, -300, 100}, 1.0F});
  const MapLayout with = layOutMap(*mapCloudOf(points, kVoxel), lookingAlongY(3));
  EXPECT_NEAR(with.top.pixels_per_m, without.top.pixels_per_m, 0.1 * without.top.pixels_per_m);
}

TEST(MapPicture, DrawsWhatThereIs) {
  const cv::Mat3b whole = drawMap(*mapCloudOf(box(), kVoxel), lookingAlongY(3), kVoxel);
  EXPECT_LE(std::max(whole.rows, whole.cols), 2000);
  const int legend = cv::countNonZero(colouredIn(drawMap(MapCloud(), lookingAlongY(3), kVoxel)));
  // 9,471 points in two views, which hide each other.
  EXPECT_GT(cv::countNonZero(colouredIn(whole)), legend + 10'000);
  EXPECT_GT(cv::countNonZero(colouredIn(
                drawMap(*mapCloudOf({{{1, 2, 3}, 1.0F}}, kVoxel), lookingAlongY(1), kVoxel))),
            0);
  EXPECT_THROW(drawMap(MapCloud(), {}, kVoxel), std::invalid_argument);
}

TEST(MapPicture, ItsBarIsARoundNumberOfMetresLong) {
  for (const double size : {0.01, 1.0, 30.0}) {
    std::vector<CloudPoint> points = box();
    for (CloudPoint& point : points) point.p_world *= size;
    const MapLayout layout = layOutMap(*mapCloudOf(points, kVoxel), lookingAlongY(1));
    const cv::Mat3b legend =
        drawMap(*mapCloudOf(points, kVoxel), lookingAlongY(1), kVoxel)(layout.legend);
    cv::Mat1b ink;
    cv::inRange(legend.colRange(0, 250), cv::Scalar::all(40), cv::Scalar::all(40), ink);
    cv::Mat1i longest;  // per row
    cv::reduce(ink / 255, longest, 1, cv::REDUCE_SUM, CV_32S);
    double bar = 0;
    cv::minMaxLoc(longest, nullptr, &bar);
    EXPECT_GT(bar, 220 / 2.6) << "as long as the next round number allows";
    double metres = bar / layout.top.pixels_per_m;
    while (metres < 0.95) metres *= 10;
    while (metres > 9.5) metres /= 10;
    const double nearest = metres < 1.5 ? 1 : metres < 3.5 ? 2 : 5;
    EXPECT_NEAR(metres, nearest, 0.51 / bar * nearest * 1.01) << size << ": half a pixel";
  }
}

TEST(KeyframeSheet, ShowsTwelveOfAnyNumberEvenly) {
  const DepthPlanesOptions limits{1, 5, 30, PlaneSpacing::kInverse};
  cv::Mat1f depth(30, 40, 0.0F);
  depth(10, 10) = 2;
  KeyframeSheet one;
  EXPECT_THROW(one.draw(limits), std::logic_error);
  one.add(0, depth);
  KeyframeSheet many;
  for (int i = 0; i < 1000; ++i) many.add(i, depth);
  for (const auto& [sheet, shown] : {std::pair(&one, 1), std::pair(&many, 12)}) {
    const cv::Mat3b picture = sheet->draw(limits);
    EXPECT_LT(picture.cols, 1700);
    cv::Mat1i labels;
    // The background, a pixel of each depth map, and the bar.
    EXPECT_EQ(cv::connectedComponents(colouredIn(picture), labels), 1 + shown + 1);
  }
  EXPECT_EQ(depth(0, 0), 0) << "the caller's depth map is as it was";
}

}  // namespace
}  // namespace efm
