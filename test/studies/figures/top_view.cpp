// SPDX-License-Identifier: BSD-3-Clause
#include "test/studies/figures/top_view.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

namespace efm::studies {
namespace {

cv::Size sizeOf(const TopView& view) {
  const Eigen::Vector2d sides = (view.high_m - view.low_m) / view.pixel_m;
  return {static_cast<int>(std::ceil(sides.x())), static_cast<int>(std::ceil(sides.y()))};
}

cv::Point pixelOf(const TopView& view, const Eigen::Vector3d& p_world) {
  return {static_cast<int>(std::floor((p_world.x() - view.low_m.x()) / view.pixel_m)),
          static_cast<int>(std::floor((view.high_m.y() - p_world.y()) / view.pixel_m))};
}

void drawWalls(const TopView& view, const std::vector<Wall>& walls, cv::Mat3b& picture) {
  for (const Wall& wall : walls) {
    if (std::abs(wall.whole.normal().z()) > 0.5) continue;
    cv::line(picture, pixelOf(view, wall.whole.pointAt(0, 0)),
             pixelOf(view, wall.whole.pointAt(wall.whole.width_m, wall.whole.height_m)),
             cv::Scalar::all(170), 1);
  }
}

}  // namespace

TopView viewOfAll(const std::vector<Wall>& walls, double pixel_m) {
  constexpr double kMarginM = 0.35;
  Eigen::AlignedBox2d box;
  for (const Wall& wall : walls) {
    box.extend(wall.whole.pointAt(0, 0).head<2>());
    box.extend(wall.whole.pointAt(wall.whole.width_m, wall.whole.height_m).head<2>());
  }
  TopView view;
  view.low_m = box.min().array() - kMarginM;
  view.high_m = box.max().array() + kMarginM;
  view.pixel_m = pixel_m;
  return view;
}

cv::Mat3b drawTopView(const MapCloud& cloud, const std::vector<Wall>& walls, const TopView& view) {
  // The density of a well visible wall: 3.5 points in a square centimetre.
  constexpr double kDarkDensity = 3.5e4;
  const auto dark_count =
      static_cast<float>(std::max(1.0, kDarkDensity * view.pixel_m * view.pixel_m));
  cv::Mat1f count(sizeOf(view), 0.0F);
  cv::Mat1f height(sizeOf(view), 0.0F);
  const cv::Rect inside({0, 0}, sizeOf(view));
  for (const MapPoint& point : cloud) {
    const Eigen::Vector3d p_world = positionIn(cloud, point);
    const double z = p_world.z();
    const cv::Point pixel = pixelOf(view, p_world);
    if (z < view.min_height_m || z > view.max_height_m || !inside.contains(pixel)) continue;
    count(pixel) += 1;
    height(pixel) +=
        static_cast<float>((z - view.min_height_m) / (view.max_height_m - view.min_height_m));
  }
  cv::Mat1b level = height / cv::max(count, 1) * 255;
  cv::Mat3b colour;
  cv::applyColorMap(level, colour, cv::COLORMAP_JET);

  cv::Mat3b picture(sizeOf(view), cv::Vec3b(255, 255, 255));
  drawWalls(view, walls, picture);
  for (int y = 0; y < picture.rows; ++y) {
    for (int x = 0; x < picture.cols; ++x) {
      if (count(y, x) == 0) continue;
      const float ink = std::min(1.0F, count(y, x) / dark_count);
      for (int c = 0; c < 3; ++c) {
        picture(y, x)[c] =
            cv::saturate_cast<uchar>((1 - ink) * static_cast<float>(picture(y, x)[c]) +
                                     ink * 0.8F * static_cast<float>(colour(y, x)[c]));
      }
    }
  }
  return picture;
}

}  // namespace efm::studies
