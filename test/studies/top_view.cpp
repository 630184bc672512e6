// SPDX-License-Identifier: BSD-3-Clause
#include "test/studies/top_view.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

namespace efm::studies {
namespace {

/// Between a place of the world and a pixel.
class Frame {
 public:
  Frame(const std::vector<Wall>& walls, const TopViewOptions& options) : pixel_m_(options.pixel_m) {
    for (const Wall& wall : walls) {
      box_.extend(wall.whole.pointAt(0, 0).head<2>());
      box_.extend(wall.whole.pointAt(wall.whole.width_m, wall.whole.height_m).head<2>());
    }
    const Eigen::Vector2d margin = Eigen::Vector2d::Constant(options.margin_m);
    box_.min() -= margin;
    box_.max() += margin;
  }

  cv::Size size() const {
    const Eigen::Vector2d sides = box_.sizes() / pixel_m_;
    return {static_cast<int>(std::ceil(sides.x())), static_cast<int>(std::ceil(sides.y()))};
  }
  cv::Point pixelOf(const Eigen::Vector3d& p_world) const {
    return {static_cast<int>(std::floor((p_world.x() - box_.min().x()) / pixel_m_)),
            static_cast<int>(std::floor((box_.max().y() - p_world.y()) / pixel_m_))};
  }

 private:
  double pixel_m_;
  Eigen::AlignedBox2d box_;
};

void drawWalls(const Frame& frame, const std::vector<Wall>& walls, cv::Mat3b& picture) {
  for (const Wall& wall : walls) {
    if (std::abs(wall.whole.normal().z()) > 0.5) continue;
    cv::line(picture, frame.pixelOf(wall.whole.pointAt(0, 0)),
             frame.pixelOf(wall.whole.pointAt(wall.whole.width_m, wall.whole.height_m)),
             cv::Scalar::all(170), 1);
  }
}

}  // namespace

cv::Mat3b drawTopView(const std::vector<CloudPoint>& points, const std::vector<Wall>& walls,
                      const TopViewOptions& options) {
  constexpr float kDarkFrom = 5;  // points in a pixel
  const Frame frame(walls, options);
  cv::Mat1f count(frame.size(), 0.0F);
  cv::Mat1f height(frame.size(), 0.0F);
  const cv::Rect inside({0, 0}, frame.size());
  for (const CloudPoint& point : points) {
    const double z = point.p_world.z();
    const cv::Point pixel = frame.pixelOf(point.p_world);
    if (z < options.min_height_m || z > options.max_height_m || !inside.contains(pixel)) continue;
    count(pixel) += 1;
    height(pixel) += static_cast<float>((z - options.min_height_m) /
                                        (options.max_height_m - options.min_height_m));
  }
  cv::Mat1b level = height / cv::max(count, 1) * 255;
  cv::Mat3b colour;
  cv::applyColorMap(level, colour, cv::COLORMAP_JET);

  cv::Mat3b picture(frame.size(), cv::Vec3b(255, 255, 255));
  drawWalls(frame, walls, picture);
  for (int y = 0; y < picture.rows; ++y) {
    for (int x = 0; x < picture.cols; ++x) {
      if (count(y, x) == 0) continue;
      const float ink = std::min(1.0F, count(y, x) / kDarkFrom);
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
