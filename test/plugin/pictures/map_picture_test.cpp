// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/pictures/map_picture.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <opencv2/imgproc.hpp>
#include <utility>

#include "mapping/geometry/angle.h"
#include "plugin/pictures/keyframe_sheet.h"
#include "plugin/pictures/map_layout.h"
#include "plugin/pictures/upward.h"
#include "test/plugin/pictures/sketch.h"

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

/// Points of an F, 1 m wide and 2 m high, along two axes, with a dot at its lower right: so the
/// smallest rectangle around it stands upright, too.
std::vector<Eigen::Vector3d> letterF(const Eigen::Vector3d& corner, const Eigen::Vector3d& right,
                                     const Eigen::Vector3d& up) {
  std::vector<Eigen::Vector3d> points;
  for (double along = 0; along <= 2; along += 0.005) points.push_back(corner + along * up);
  for (double along = 0; along <= 1; along += 0.005) {
    points.push_back(corner + 2 * up + along * right);
    if (along <= 0.5) points.push_back(corner + up + along * right);
    if (along >= 0.9) points.push_back(corner + along * right);
  }
  return points;
}

/// The part of a line of pixels that is set.
double shareOf(const cv::Mat1b& mask) {
  return static_cast<double>(cv::countNonZero(mask)) / static_cast<double>(mask.total());
}

/// Whether a mask shows an F, upright and not mirrored.
void expectF(const cv::Mat1b& mask) {
  const cv::Rect box = cv::boundingRect(mask);
  const cv::Mat1b letter = mask(box);
  const int width = std::max(3, box.width / 20);
  EXPECT_NEAR(static_cast<double>(box.height) / box.width, 2, 0.2);
  cv::Mat1b any;
  const auto along = [&](const cv::Rect& part, int dimension) {
    cv::reduce(letter(part), any, dimension, cv::REDUCE_MAX);
    return shareOf(any);
  };
  EXPECT_GT(along({0, 0, width, box.height}, 1), 0.95) << "the stem is at the left";
  EXPECT_GT(along({0, 0, box.width, width}, 0), 0.95) << "the long arm is at the top";
  EXPECT_NEAR(along({0, (box.height - width) / 2, box.width, width}, 0), 0.55, 0.1);
  EXPECT_LT(along({0, box.height - width, box.width, width}, 0), 0.3) << "stem and dot alone";
}

TEST(MapPicture, AnFStandsUprightInBothViews) {
  // World frames with z up, with y down (the first camera's), and with cameras that look back.
  const Eigen::Matrix3d y_down =
      Eigen::AngleAxisd(0.5 * kPi, Eigen::Vector3d::UnitX()).toRotationMatrix();
  const Eigen::Matrix3d back = Eigen::AngleAxisd(kPi, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  for (const Eigen::Matrix3d& R : {Eigen::Matrix3d(Eigen::Matrix3d::Identity()), y_down, back}) {
    std::vector<StampedPose> trajectory = lookingAlongY(3);
    for (StampedPose& pose : trajectory) {
      pose.T_world_rig = Rigid3{Eigen::Quaterniond(R), {0, 0, 0}} * pose.T_world_rig;
    }
    // It rises as it goes away: the same letter from above and from the side.
    std::vector<CloudPoint> points;
    for (const Eigen::Vector3d& p : letterF({-0.4, 1, 0}, {1, 0, 0}, {0, 1, 1})) {
      points.push_back({R * p, 1.0F});
    }
    const MapCloud::ConstPtr cloud = mapCloudOf(points, kVoxel);
    const MapLayout layout = layOutMap(*cloud, trajectory);
    const cv::Mat3b picture = drawMap(*cloud, trajectory, kVoxel);
    for (const MapView* view : {&layout.top, &layout.side}) {
      const cv::Mat3b area = picture(view->area);
      const cv::Mat1b mask = colouredIn(area);
      expectF(mask);
      const cv::Rect box = cv::boundingRect(mask);
      EXPECT_NEAR(box.width, view->pixels_per_m, 0.1 * view->pixels_per_m) << "it is 1 m wide";
      const cv::Scalar high = cv::mean(area(cv::Rect(box.x, box.y, box.width, 3)),
                                       mask(cv::Rect(box.x, box.y, box.width, 3)));
      const cv::Rect foot(box.x, box.br().y - 6, box.width, 3);
      const cv::Scalar low = cv::mean(area(foot), mask(foot));
      EXPECT_GT(high[2], high[0]) << "high is red";
      EXPECT_GT(low[0], low[2]) << "low is blue";
    }
  }
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
