// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/motion/event_contrast.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

namespace efm {
namespace {

/// The sum of the squares of the images' harmonic mean. Replaces each image by the derivative by
/// its values.
double fuse(std::vector<cv::Mat1f>& images) {
  constexpr float kMinValue = 1e-6F;  // events; the mean is 0 where a camera has fewer
  const auto cameras = static_cast<float>(images.size());
  double contrast = 0;
  for (int y = 0; y < images.front().rows; ++y) {
    for (int x = 0; x < images.front().cols; ++x) {
      float minimum = images.front()(y, x);
      for (const cv::Mat1f& image : images) minimum = std::min(minimum, image(y, x));
      if (minimum < kMinValue) {
        for (cv::Mat1f& image : images) image(y, x) = 0;
        continue;
      }
      float inverse_sum = 0;
      for (const cv::Mat1f& image : images) inverse_sum += 1 / image(y, x);
      const float mean = cameras / inverse_sum;
      contrast += double{mean} * double{mean};
      for (cv::Mat1f& image : images) {
        const float ratio = mean / image(y, x);
        image(y, x) = 2 * mean * ratio * ratio / cameras;
      }
    }
  }
  return contrast;
}

}  // namespace

/// The four pixels between which an event lies.
struct EventContrast::Cell {
  int x = 0;
  int y = 0;
  float right = 0;  // weight of the right two
  float below = 0;  // weight of the lower two
  bool inside = false;
};

EventContrast::EventContrast(const std::vector<std::vector<WarpedEvent>>& events, cv::Size view,
                             int patch_px)
    : events_(events), view_(view) {
  const int columns = (view.width - 1) / patch_px + 1;
  const int rows = (view.height - 1) / patch_px + 1;
  const auto patches = static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows);
  std::vector<int> variable_of(patches, -1);
  for (const auto& of_camera : events) {
    std::vector<int>& patch_of = patches_.emplace_back();
    for (const WarpedEvent& event : of_camera) {
      const auto column =
          std::clamp(static_cast<int>(event.pixel.x()), 0, view.width - 1) / patch_px;
      const auto row = std::clamp(static_cast<int>(event.pixel.y()), 0, view.height - 1) / patch_px;
      const int patch = row * columns + column;
      int& variable = variable_of[static_cast<std::size_t>(patch)];
      if (variable < 0) {
        variable = static_cast<int>(events_in_patch_.size());
        events_in_patch_.push_back(0);
      }
      ++events_in_patch_[static_cast<std::size_t>(variable)];
      patch_of.push_back(variable);
    }
  }
}

EventContrast::Cell EventContrast::cellOf(std::size_t camera, std::size_t event,
                                          const Change& change) const {
  const WarpedEvent& warped = events_[camera][event];
  const Eigen::Vector2f pixel = warped.pixel + warped.by_velocity * change.head<6>() +
                                warped.by_inverse_depth * change[6 + patches_[camera][event]];
  Cell cell;
  const float x = std::floor(pixel.x());
  const float y = std::floor(pixel.y());
  cell.inside = x >= 0 && y >= 0 && x < static_cast<float>(view_.width - 1) &&
                y < static_cast<float>(view_.height - 1);
  if (!cell.inside) return cell;
  cell.x = static_cast<int>(x);
  cell.y = static_cast<int>(y);
  cell.right = pixel.x() - x;
  cell.below = pixel.y() - y;
  return cell;
}

cv::Mat1f EventContrast::imageOf(std::size_t camera, const Change& change) const {
  cv::Mat1f image = cv::Mat1f::zeros(view_);
  for (std::size_t i = 0; i < events_[camera].size(); ++i) {
    const Cell cell = cellOf(camera, i, change);
    if (!cell.inside) continue;
    float* upper = image[cell.y] + cell.x;
    float* lower = image[cell.y + 1] + cell.x;
    upper[0] += (1 - cell.right) * (1 - cell.below);
    upper[1] += cell.right * (1 - cell.below);
    lower[0] += (1 - cell.right) * cell.below;
    lower[1] += cell.right * cell.below;
  }
  return image;
}

cv::Mat1f EventContrast::smoothed(const cv::Mat1f& image) const {
  cv::Mat1f result;
  const int side = 2 * static_cast<int>(std::ceil(3 * blur_px_)) + 1;
  // A border of zeros makes smoothing its own transpose: the gradient needs that.
  cv::GaussianBlur(image, result, cv::Size(side, side), blur_px_, blur_px_, cv::BORDER_CONSTANT);
  return result;
}

Eigen::VectorXd EventContrast::gradientOf(std::size_t camera, const Change& change,
                                          const cv::Mat1f& by_pixel_value) const {
  Eigen::VectorXd gradient = Eigen::VectorXd::Zero(variables());
  for (std::size_t i = 0; i < events_[camera].size(); ++i) {
    const Cell cell = cellOf(camera, i, change);
    if (!cell.inside) continue;
    const float* upper = by_pixel_value[cell.y] + cell.x;
    const float* lower = by_pixel_value[cell.y + 1] + cell.x;
    const Eigen::RowVector2f by_pixel(
        (1 - cell.below) * (upper[1] - upper[0]) + cell.below * (lower[1] - lower[0]),
        (1 - cell.right) * (lower[0] - upper[0]) + cell.right * (lower[1] - upper[1]));
    const WarpedEvent& event = events_[camera][i];
    gradient.head<6>() += (by_pixel * event.by_velocity).transpose().cast<double>();
    gradient[6 + patches_[camera][i]] += static_cast<double>(by_pixel * event.by_inverse_depth);
  }
  return gradient;
}

double EventContrast::at(const Eigen::VectorXd& change, Eigen::VectorXd& gradient) const {
  const Change narrow = change.cast<float>();
  std::vector<cv::Mat1f> images(events_.size());
  tbb::parallel_for(std::size_t{0}, events_.size(), [&](std::size_t camera) {
    images[camera] = smoothed(imageOf(camera, narrow));
  });
  const double contrast = fuse(images);
  std::vector<Eigen::VectorXd> gradients(events_.size());
  tbb::parallel_for(std::size_t{0}, events_.size(), [&](std::size_t camera) {
    gradients[camera] = gradientOf(camera, narrow, smoothed(images[camera]));
  });
  gradient = Eigen::VectorXd::Zero(variables());
  for (const Eigen::VectorXd& of_camera : gradients) gradient += of_camera;
  return contrast;
}

}  // namespace efm
