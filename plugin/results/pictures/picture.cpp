// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/results/pictures/picture.h"

#include <opencv2/imgproc.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "mapping/geometry/rigid3.h"

namespace efm {

namespace {

const cv::Scalar kWhite = cv::Scalar::all(255);
constexpr int kGap = 8;  // pixels between two pictures

cv::Mat3b joined(const std::vector<cv::Mat3b>& pictures, bool beside) {
  cv::Size largest;
  for (const cv::Mat3b& picture : pictures) {
    largest = {std::max(largest.width, picture.cols), std::max(largest.height, picture.rows)};
  }
  std::vector<cv::Mat3b> padded(pictures.size());
  for (std::size_t i = 0; i < pictures.size(); ++i) {
    const cv::Size missing = largest - pictures[i].size();
    const int gap = i > 0 ? kGap : 0;
    const int left = beside ? gap : missing.width / 2;
    cv::copyMakeBorder(pictures[i], padded[i], beside ? 0 : gap, beside ? missing.height : 0, left,
                       beside ? 0 : missing.width - left, cv::BORDER_CONSTANT, kWhite);
  }
  cv::Mat3b whole;
  beside ? cv::hconcat(padded, whole) : cv::vconcat(padded, whole);
  return whole;
}

}  // namespace

cv::Mat3b sideBySide(const std::vector<cv::Mat3b>& pictures) { return joined(pictures, true); }
cv::Mat3b oneBelowAnother(const std::vector<cv::Mat3b>& pictures) {
  return joined(pictures, false);
}

namespace {

/// Returns the colours of the levels 0 to 255: a part of one of OpenCV's colour maps.
cv::Mat3b tableOf(Palette palette) {
  struct {
    cv::ColormapTypes map;
    double from, to;
  } source = {cv::COLORMAP_PLASMA, 0.88, 0};  // kBrightToDark: reversed
  if (palette == Palette::kBlueToRed) source = {cv::COLORMAP_JET, 0, 1};
  if (palette == Palette::kRainbow) source = {cv::COLORMAP_TURBO, 0.06, 0.96};
  cv::Mat1b positions(1, 256);
  for (int level = 0; level < 256; ++level) {
    positions(0, level) =
        cv::saturate_cast<uchar>(255 * source.from + (source.to - source.from) * level);
  }
  cv::Mat3b table;
  cv::applyColorMap(positions, table, source.map);
  return table;
}

}  // namespace

cv::Mat3b coloured(const cv::Mat1b& levels, Palette palette) {
  cv::Mat3b picture;
  if (palette == Palette::kWhiteToBlack) {
    cv::cvtColor(~levels, picture, cv::COLOR_GRAY2BGR);
  } else {
    cv::applyColorMap(levels, picture, tableOf(palette).reshape(3, 256));
  }
  return picture;
}

Eigen::Vector3d upwardOf(const std::vector<StampedPose>& trajectory) {
  constexpr int kSteps = 100;
  constexpr double kPull = 0.05;  // weak pull towards -y, for cases that the x axes leave open
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  Eigen::Matrix3d across = Eigen::Matrix3d::Zero();
  for (const StampedPose& pose : trajectory) {
    const Eigen::Matrix3d R_world_ref = pose.T_world_rig.rotation.toRotationMatrix();
    mean -= R_world_ref.col(1);
    across += R_world_ref.col(0) * R_world_ref.col(0).transpose();
  }
  const auto count = static_cast<double>(trajectory.size());
  if (!(mean.norm() > 0.2 * count)) return Eigen::Vector3d::UnitZ();
  const Eigen::Vector3d guess = mean.normalized();
  across /= count;
  Eigen::Vector3d up = guess;
  for (int step = 0; step < kSteps; ++step) {  // power iteration: the largest eigenvalue
    up = (up + kPull * up.dot(guess) * guess - across * up).normalized();
  }
  if (up.dot(guess) < 0) up = -up;
  int axis = 0;
  if (up.cwiseAbs().maxCoeff(&axis) < std::cos(15 * kRadiansPerDegree)) return up;
  return std::copysign(1.0, up[axis]) * Eigen::Vector3d::Unit(axis);
}

std::vector<PointColour> coloursByHeight(const MapCloud& cloud, const Eigen::Vector3d& upward) {
  if (cloud.empty()) return {};
  std::vector<double> sorted;
  for (const MapPoint& point : cloud) sorted.push_back(upward.dot(positionIn(cloud, point)));
  std::sort(sorted.begin(), sorted.end());
  const std::size_t hundredth = sorted.size() / 100;
  const double low = sorted[hundredth];
  const double range = std::max(sorted[sorted.size() - 1 - hundredth] - low, 1e-9);

  cv::Mat1b levels(1, 256);
  for (int level = 0; level < 256; ++level) levels(level) = cv::saturate_cast<uchar>(255 - level);
  const cv::Mat3b table = coloured(levels, Palette::kBrightToDark);
  std::vector<PointColour> colours;
  for (const MapPoint& point : cloud) {
    const double height = (upward.dot(positionIn(cloud, point)) - low) / range;
    const cv::Vec3b& bgr = table(static_cast<int>(255 * std::clamp(height, 0.0, 1.0)));
    colours.push_back({bgr[2], bgr[1], bgr[0]});
  }
  return colours;
}

}  // namespace efm
