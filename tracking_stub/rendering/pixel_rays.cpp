// SPDX-License-Identifier: BSD-3-Clause
#include "tracking_stub/rendering/pixel_rays.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "mapping/base/named_choice.h"
#include "mapping/geometry/lens.h"

namespace efm {

PixelRays::PixelRays(const CameraModel& model) : width_(model.width), height_(model.height) {
  requireOption(width_ >= 2, "width", width_, "at least 2 pixels to be simulated");
  requireOption(height_ >= 2, "height", height_, "at least 2 pixels to be simulated");
  model.validate();
  // Not the mapping's table: it has floats, whose rounding would be an error of the truth.
  const LensInverse lens(model);
  std::vector<Eigen::Vector2d> table;
  table.reserve(static_cast<std::size_t>(width_) * static_cast<std::size_t>(height_));
  for (int y = 0; y < height_; ++y) {
    for (int x = 0; x < width_; ++x) table.push_back(lens.rayThrough(x, y));
  }
  const auto at = [&](int x, int y) -> const Eigen::Vector2d& {
    return table[static_cast<std::size_t>(y * width_ + x)];
  };
  const auto has_ray = [&](int x, int y) {
    return x >= 0 && y >= 0 && x < width_ && y < height_ && !std::isnan(at(x, y).x());
  };
  rays_.reserve(table.size());
  bounds_.min.setConstant(std::numeric_limits<double>::infinity());
  bounds_.max = -bounds_.min;
  for (int y = 0; y < height_; ++y) {
    for (int x = 0; x < width_; ++x) {
      PixelRay& pixel = rays_.emplace_back();
      if (!has_ray(x, y)) continue;
      // Towards pixels that have a ray, too: not over the border of the sensor or the lens.
      const int left = has_ray(x - 1, y) ? x - 1 : x;
      const int right = has_ray(x + 1, y) ? x + 1 : x;
      const int up = has_ray(x, y - 1) ? y - 1 : y;
      const int down = has_ray(x, y + 1) ? y + 1 : y;
      if (left == right || up == down) continue;
      pixel.ray = at(x, y);
      pixel.per_x = (at(right, y) - at(left, y)) / (right - left);
      pixel.per_y = (at(x, down) - at(x, up)) / (down - up);
      pixel.pitch = std::sqrt(0.5 * (pixel.per_x.squaredNorm() + pixel.per_y.squaredNorm()));
      const Eigen::Vector2d half_pixel = 0.5 * (pixel.per_x.cwiseAbs() + pixel.per_y.cwiseAbs());
      bounds_.min = bounds_.min.cwiseMin(pixel.ray - half_pixel);
      bounds_.max = bounds_.max.cwiseMax(pixel.ray + half_pixel);
    }
  }
  requireOption((bounds_.min.array() < bounds_.max.array()).all(), "pixels with a viewing ray", 0,
                "some: the lens projects no ray to the sensor");
}

}  // namespace efm
