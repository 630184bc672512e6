// SPDX-License-Identifier: BSD-3-Clause
#include "tracking_stub/rendering/pixel_rays.h"

#include <algorithm>
#include <cmath>

#include "mapping/geometry/undistortion.h"
#include "mapping/options/option_check.h"

namespace efm {

PixelRays::PixelRays(const CameraModel& model) : width_(model.width), height_(model.height) {
  requireOption(width_ >= 2, "width", width_, "at least 2 pixels to be simulated");
  requireOption(height_ >= 2, "height", height_, "at least 2 pixels to be simulated");
  model.validate();
  // The mapping's undistortion table has floats: their rounding would be an error of the truth.
  std::vector<std::vector<Eigen::Vector2d>> table;
  for (int y = 0; y < height_; ++y) table.push_back(viewingRays(model, y));
  const auto at = [&](int x, int y) -> const Eigen::Vector2d& {
    return table[static_cast<std::size_t>(y)][static_cast<std::size_t>(x)];
  };
  rays_.reserve(static_cast<std::size_t>(width_) * static_cast<std::size_t>(height_));
  bounds_ = {at(0, 0), at(0, 0)};
  for (int y = 0; y < height_; ++y) {
    for (int x = 0; x < width_; ++x) {
      const int left = std::max(x - 1, 0);
      const int right = std::min(x + 1, width_ - 1);
      const int up = std::max(y - 1, 0);
      const int down = std::min(y + 1, height_ - 1);
      PixelRay pixel;
      pixel.ray = at(x, y);
      pixel.per_x = (at(right, y) - at(left, y)) / (right - left);
      pixel.per_y = (at(x, down) - at(x, up)) / (down - up);
      pixel.pitch = std::sqrt(0.5 * (pixel.per_x.squaredNorm() + pixel.per_y.squaredNorm()));
      rays_.push_back(pixel);
      const Eigen::Vector2d half_pixel = 0.5 * (pixel.per_x.cwiseAbs() + pixel.per_y.cwiseAbs());
      bounds_.min = bounds_.min.cwiseMin(pixel.ray - half_pixel);
      bounds_.max = bounds_.max.cwiseMax(pixel.ray + half_pixel);
    }
  }
}

}  // namespace efm
