// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/event_contrast.h"

#include <cmath>
#include <cstdlib>
#include <opencv2/imgproc.hpp>

namespace efm {
namespace {

/// The four pixels between which an event lies.
struct Cell {
  int x = 0;
  int y = 0;
  float right = 0;  // share of the right two
  float below = 0;
  bool inside = false;
};

Cell cellOf(const WarpedEvent& event, const Eigen::Matrix<float, 6, 1>& velocity, cv::Size view) {
  const Eigen::Vector2f pixel = event.pixel + event.by_velocity * velocity;
  Cell cell;
  const float x = std::floor(pixel.x());
  const float y = std::floor(pixel.y());
  cell.inside = x >= 0 && y >= 0 && x < static_cast<float>(view.width - 1) &&
                y < static_cast<float>(view.height - 1);
  if (!cell.inside) return cell;
  cell.x = static_cast<int>(x);
  cell.y = static_cast<int>(y);
  cell.right = pixel.x() - x;
  cell.below = pixel.y() - y;
  return cell;
}
int mode() {
  const char* m = std::getenv("EFM_MODE");
  return m ? std::atoi(m) : 1;
}

}  // namespace

EventContrast::EventContrast(const std::vector<std::vector<WarpedEvent>>& events, cv::Size view,
                             double blur_px)
    : events_(events), view_(view), blur_px_(blur_px) {}

cv::Mat1f EventContrast::imageOf(const std::vector<WarpedEvent>& events,
                                 const VelocityVector& velocity) const {
  cv::Mat1f image = cv::Mat1f::zeros(view_);
  const Eigen::Matrix<float, 6, 1> v = velocity.cast<float>();
  for (const WarpedEvent& event : events) {
    const Cell cell = cellOf(event, v, view_);
    if (!cell.inside) continue;
    float* row = image[cell.y] + cell.x;
    float* next = image[cell.y + 1] + cell.x;
    row[0] += (1 - cell.right) * (1 - cell.below);
    row[1] += cell.right * (1 - cell.below);
    next[0] += (1 - cell.right) * cell.below;
    next[1] += cell.right * cell.below;
  }
  return image;
}

cv::Mat1f EventContrast::smoothed(const cv::Mat1f& image) const {
  cv::Mat1f result;
  // Zeros around, so that smoothing is its own transpose.
  cv::GaussianBlur(image, result, cv::Size(), blur_px_, blur_px_, cv::BORDER_CONSTANT);
  return result;
}

EventContrast::Value EventContrast::at(const VelocityVector& velocity) const {
  Value value;
  const std::size_t n = events_.size();
  std::vector<cv::Mat1f> images;
  for (const auto& events : events_) images.push_back(smoothed(imageOf(events, velocity)));
  std::vector<cv::Mat1f> slopes(n);  // d contrast / d image
  const int m = mode();
  if (m == 0) {
    for (std::size_t c = 0; c < n; ++c) {
      value.contrast += images[c].dot(images[c]);
      slopes[c] = 2 * images[c];
    }
  } else if (m == 1) {
    cv::Mat1f sum = images[0].clone();
    for (std::size_t c = 1; c < n; ++c) sum += images[c];
    value.contrast = sum.dot(sum);
    for (std::size_t c = 0; c < n; ++c) slopes[c] = 2 * sum;
  } else if (m == 2) {  // cross only (two)
    value.contrast = n > 1 ? images[0].dot(images[1]) : images[0].dot(images[0]);
    if (n > 1) {
      slopes[0] = images[1];
      slopes[1] = images[0];
    } else
      slopes[0] = 2 * images[0];
  } else {  // squared harmonic mean
    for (std::size_t c = 0; c < n; ++c) slopes[c] = cv::Mat1f::zeros(view_);
    for (int y = 0; y < view_.height; ++y)
      for (int x = 0; x < view_.width; ++x) {
        double inv = 0;
        for (std::size_t c = 0; c < n; ++c) inv += 1 / (images[c](y, x) + 1e-6);
        const double h = n / inv;
        value.contrast += h * h;
        for (std::size_t c = 0; c < n; ++c) {
          const double i = images[c](y, x) + 1e-6;
          slopes[c](y, x) = 2 * h * h * h / (n * i * i);
        }
      }
  }
  const Eigen::Matrix<float, 6, 1> v = velocity.cast<float>();
  for (std::size_t c = 0; c < n; ++c) {
    const cv::Mat1f slope = smoothed(slopes[c]);
    for (const WarpedEvent& event : events_[c]) {
      const Cell cell = cellOf(event, v, view_);
      if (!cell.inside) continue;
      const float* row = slope[cell.y] + cell.x;
      const float* next = slope[cell.y + 1] + cell.x;
      const double dx = (1 - cell.below) * (row[1] - row[0]) + cell.below * (next[1] - next[0]);
      const double dy = (1 - cell.right) * (next[0] - row[0]) + cell.right * (next[1] - row[1]);
      value.gradient += event.by_velocity.row(0).transpose().cast<double>() * dx +
                        event.by_velocity.row(1).transpose().cast<double>() * dy;
    }
  }
  return value;
}

}  // namespace efm
