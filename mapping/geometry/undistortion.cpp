// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/geometry/undistortion.h"

#include <opencv2/calib3d.hpp>
#include <opencv2/core.hpp>

namespace efm {
namespace {

/// OpenCV's default of 5 iterations leaves errors of some tenths of a pixel in the corners.
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

std::vector<Eigen::Vector2d> viewingRays(const CameraModel& model, int y) {
  std::vector<cv::Point2d> pixels;
  for (int x = 0; x < model.width; ++x) pixels.emplace_back(x, y);
  std::vector<Eigen::Vector2d> rays;
  rays.reserve(pixels.size());
  for (const cv::Point2d& ray : undistort(model, pixels)) rays.emplace_back(ray.x, ray.y);
  return rays;
}

UndistortionTable::UndistortionTable(const CameraModel& model) {
  model.validate();
  width_ = model.width;
  height_ = model.height;
  rays_.reserve(static_cast<std::size_t>(width_) * static_cast<std::size_t>(height_));
  for (int y = 0; y < height_; ++y) {
    for (const Eigen::Vector2d& ray : viewingRays(model, y)) rays_.push_back(ray.cast<float>());
  }
}

}  // namespace efm
