// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/results/pictures/map_picture.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <stdexcept>

#include "mapping/depth/peak_fit.h"
#include "mapping/geometry/rigid3.h"
#include "plugin/results/pictures/map_layout.h"
#include "plugin/results/pictures/plot_frame.h"
#include "plugin/results/pictures/value_picture.h"

namespace efm {
namespace {

constexpr double kLabelScale = 0.55;
constexpr Palette kHeightPalette = Palette::kRainbow;
const cv::Scalar kMapGrey = cv::Scalar::all(210);
constexpr int kPathSubpixelBits = 4;

/// Adds a weight of 1 around a position, to the four nearest pixels.
class Splats {
 public:
  explicit Splats(cv::Size size) : weights_(size, 0.0F), heights_(size, 0.0F) {}

  void add(const cv::Point2d& at, float height) {
    const int x = cvFloor(at.x), y = cvFloor(at.y);
    if (x < 0 || y < 0 || x + 1 >= weights_.cols || y + 1 >= weights_.rows) return;
    const auto u = static_cast<float>(at.x - x), v = static_cast<float>(at.y - y);
    addTo(x, y, (1 - u) * (1 - v), height);
    addTo(x + 1, y, u * (1 - v), height);
    addTo(x, y + 1, (1 - u) * v, height);
    addTo(x + 1, y + 1, u * v, height);
  }

  /// Colours of the mean height, on white: the more opaque the more points there are.
  cv::Mat3b picture(double sigma) {
    cv::GaussianBlur(weights_, weights_, {}, sigma);
    cv::GaussianBlur(heights_, heights_, {}, sigma);
    const double lone = 1 / (2 * kPi * sigma * sigma);  // the weight at a point without neighbours
    weights_ *= 1 / lone;
    heights_ *= 1 / lone;
    const float typical = typicalWeight();
    cv::Mat1b levels(weights_.size(), uchar{0});
    for (int y = 0; y < levels.rows; ++y) {
      for (int x = 0; x < levels.cols; ++x) {
        const float weight = weights_(y, x);
        if (weight > 1e-3F) levels(y, x) = cv::saturate_cast<uchar>(255 * heights_(y, x) / weight);
      }
    }
    cv::Mat3b picture = coloured(levels, kHeightPalette);
    for (int y = 0; y < levels.rows; ++y) {
      for (int x = 0; x < levels.cols; ++x) {
        const float opacity = 1 - std::exp(-weights_(y, x) / typical);
        cv::Vec3b& pixel = picture(y, x);
        for (int k = 0; k < 3; ++k) {
          pixel[k] = cv::saturate_cast<uchar>(255 - opacity * static_cast<float>(255 - pixel[k]));
        }
      }
    }
    return picture;
  }

 private:
  void addTo(int x, int y, float weight, float height) {
    weights_(y, x) += weight;
    heights_(y, x) += weight * height;
  }

  float typicalWeight() const {
    std::vector<float> weights;
    for (const float weight : weights_) {
      if (weight > 0.08F) weights.push_back(weight);
    }
    if (weights.empty()) return 1;
    return std::max(0.6F, upperMedian(weights));
  }

  cv::Mat1f weights_;
  cv::Mat1f heights_;  // sums, weighted
};

AxisRange heightsOf(const MapLayout& layout) { return {layout.heights_m[0], layout.heights_m[1]}; }

void drawPoints(cv::Mat3b& picture, const MapView& view, const MapCloud& cloud,
                const MapLayout& layout, double sigma) {
  const Eigen::Vector3d& up = layout.side.upwards;
  const AxisRange heights = heightsOf(layout);
  Splats splats(view.area.size());
  const cv::Point2d corner = view.area.tl();
  for (const MapPoint& point : cloud) {
    const Eigen::Vector3d p_world = positionIn(cloud, point);
    const double level = std::clamp(heights.fractionAlong(p_world.dot(up)), 0.0, 1.0);
    splats.add(view.pixelOf(p_world) - corner, static_cast<float>(level));
  }
  splats.picture(sigma).copyTo(picture(view.area));
}

void drawTrajectory(cv::Mat3b& picture, const MapView& view,
                    const std::vector<StampedPose>& trajectory) {
  cv::Mat3b area = picture(view.area);
  const cv::Point2d corner = view.area.tl();
  std::vector<cv::Point> pixels;
  for (const StampedPose& pose : trajectory) {
    const cv::Point2d pixel = view.pixelOf(pose.T_world_rig.translation) - corner;
    constexpr double kOnes = 1 << kPathSubpixelBits;
    pixels.emplace_back(cvRound(pixel.x * kOnes), cvRound(pixel.y * kOnes));
  }
  if (pixels.empty()) return;
  const cv::Scalar white = cv::Scalar::all(255);
  cv::polylines(area, pixels, false, white, 6, cv::LINE_AA, kPathSubpixelBits);
  cv::polylines(area, pixels, false, kPlotInk, 2, cv::LINE_AA, kPathSubpixelBits);
  const auto dot = [&](const cv::Point& at, int radius, const cv::Scalar& colour) {
    cv::circle(area, at, radius << kPathSubpixelBits, colour, cv::FILLED, cv::LINE_AA,
               kPathSubpixelBits);
  };
  dot(pixels.front(), 8, white);
  dot(pixels.front(), 6, kPlotInk);
  dot(pixels.back(), 8, white);
  dot(pixels.back(), 6, kPlotInk);
  dot(pixels.back(), 4, white);
}

/// 1, 2 or 5 times a power of ten.
double roundLength(double max_m) {
  const double power = std::pow(10.0, std::floor(std::log10(max_m)));
  for (const double factor : {5.0, 2.0}) {
    if (factor * power <= max_m) return factor * power;
  }
  return power;
}

void drawLegend(cv::Mat3b& picture, const MapLayout& layout, bool has_points) {
  const cv::Rect& area = layout.legend;
  const double scale = layout.top.pixels_per_m;
  const double length_m = roundLength(220 / scale);
  const int length = cvRound(length_m * scale);
  cv::rectangle(picture, cv::Rect(area.x, area.y + 14, length, 6), kPlotInk, cv::FILLED);
  writeText(picture, fmt::format("{:g} m", length_m), {area.x, area.br().y - 10}, kLabelScale);
  const cv::Point sample(area.x + 290, area.y + 17);
  cv::line(picture, sample, sample + cv::Point(60, 0), kPlotInk, 2, cv::LINE_AA);
  cv::circle(picture, sample, 6, kPlotInk, cv::FILLED, cv::LINE_AA);
  cv::circle(picture, sample + cv::Point(60, 0), 6, kPlotInk, cv::FILLED, cv::LINE_AA);
  cv::circle(picture, sample + cv::Point(60, 0), 4, cv::Scalar::all(255), cv::FILLED, cv::LINE_AA);
  writeText(picture, "start to end", {sample.x - 6, area.br().y - 10}, kLabelScale);
  if (!has_points) return;
  const int width = std::min(600, area.width - 460);
  const cv::Mat3b bar = drawBar(heightsOf(layout), kHeightPalette, "height (m)", width);
  bar.copyTo(picture(cv::Rect({area.br().x - width, area.y + 6}, bar.size())));
}

}  // namespace

cv::Mat3b drawMap(const MapCloud& cloud, const std::vector<StampedPose>& trajectory,
                  double voxel_size_m) {
  if (cloud.empty() && trajectory.empty()) {
    throw std::invalid_argument("a map without points and keyframes has no picture");
  }
  const MapLayout layout = layOutMap(cloud, trajectory);
  // Few points on much paper are drawn larger.
  const double pixels_per_point =
      layout.top.area.area() / (1.0 + static_cast<double>(cloud.size()));
  const double sigma = std::clamp(
      std::max(0.6 * voxel_size_m * layout.top.pixels_per_m, 0.1 * std::sqrt(pixels_per_point)),
      0.8, 3.0);
  cv::Mat3b picture(layout.size, cv::Vec3b(255, 255, 255));
  for (const auto& [view, name] : {std::pair{layout.top, "top view"}, {layout.side, "side view"}}) {
    drawPoints(picture, view, cloud, layout, sigma);
    drawTrajectory(picture, view, trajectory);
    cv::rectangle(picture, view.area, kMapGrey);
    writeText(picture, name, view.area.tl() - cv::Point(0, 8), kLabelScale);
  }
  drawLegend(picture, layout, !cloud.empty());
  return picture;
}

}  // namespace efm
