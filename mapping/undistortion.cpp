// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/undistortion.h"

#include <opencv2/calib3d.hpp>
#include <opencv2/core.hpp>

namespace efm {
namespace {

/// OpenCV's default of 5 iterations leaves errors of tenths of a pixel in the corners.
constexpr int kIterations = 50;
constexpr double kEpsilon = 1e-12;

std::vector<cv::Point2d> undistort(const CameraModel& model,
                                   const std::vector<cv::Point2d>& pixels) {
  const cv::Matx33d intrinsics(model.fx, 0, model.cx, 0, model.fy, model.cy, 0, 0, 1);
  const cv::TermCriteria until(cv::TermCriteria::COUNT + cv::TermCriteria::EPS, kIterations,
                               kEpsilon);
  std::vector<cv::Point2d> rays;
  if (model.distortion == DistortionModel::kEquidistant) {
    cv::fisheye::undistortPoints(pixels, rays, intrinsics, model.coefficients, cv::noArray(),
                                 cv::noArray(), until);
  } else {
    cv::undistortPoints(pixels, rays, intrinsics, model.coefficients, cv::noArray(), cv::noArray(),
                        until);
  }
  return rays;
}

}  // namespace

UndistortionTable::UndistortionTable(const CameraModel& model) {
  model.validate();
  width_ = model.width;
  height_ = model.height;
  rays_.reserve(static_cast<std::size_t>(width_) * static_cast<std::size_t>(height_));
  std::vector<cv::Point2d> row(static_cast<std::size_t>(width_));
  for (int y = 0; y < height_; ++y) {
    for (int x = 0; x < width_; ++x) row[static_cast<std::size_t>(x)] = cv::Point2d(x, y);
    for (const cv::Point2d& ray : undistort(model, row)) {
      rays_.emplace_back(static_cast<float>(ray.x), static_cast<float>(ray.y));
    }
  }
}

}  // namespace efm
