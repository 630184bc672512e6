// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/geometry/undistortion.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <stdexcept>

#include "mapping/geometry/lens_inverse.h"

namespace efm {

UndistortionTable::UndistortionTable(const CameraModel& model)
    : width_(model.width), height_(model.height) {
  const LensInverse lens(model);
  rays_.resize(static_cast<std::size_t>(width_) * static_cast<std::size_t>(height_));
  tbb::parallel_for(0, height_, [&](int y) {
    const auto row = rays_.begin() + static_cast<std::ptrdiff_t>(y) * width_;
    Eigen::Vector2d before = LensInverse::noRay();
    Eigen::Vector2d last = before;
    for (int x = 0; x < width_; ++x) {
      const Eigen::Vector2d ray = lens.rayThrough(x, y, 2 * last - before);
      row[x] = ray.cast<float>();
      before = last;
      last = ray;
    }
  });
  center_x_ = static_cast<int>(std::clamp(model.cx, 0.0, width_ - 1.0));
  center_y_ = static_cast<int>(std::clamp(model.cy, 0.0, height_ - 1.0));
  if (hasRay(center_x_, center_y_)) return;
  const auto seen = std::find_if(rays_.begin(), rays_.end(),
                                 [](const Eigen::Vector2f& ray) { return !std::isnan(ray.x()); });
  if (seen == rays_.end()) {
    throw std::invalid_argument(
        "the lens: no pixel of the sensor has a viewing ray by its distortion coefficients and "
        "principal point");
  }
  center_x_ = static_cast<int>((seen - rays_.begin()) % width_);
  center_y_ = static_cast<int>((seen - rays_.begin()) / width_);
}

Eigen::Vector2d UndistortionTable::rayNear(int x, int y) const {
  const int steps = std::max({std::abs(center_x_ - x), std::abs(center_y_ - y), 1});
  for (int step = 0; step < steps; ++step) {
    const int column = x + (center_x_ - x) * step / steps;
    const int row = y + (center_y_ - y) * step / steps;
    if (hasRay(column, row)) return ray(column, row);
  }
  return ray(center_x_, center_y_);
}

std::vector<bool> UndistortionTable::outsideLens() const {
  std::vector<bool> outside(rays_.size());
  std::transform(rays_.begin(), rays_.end(), outside.begin(),
                 [](const Eigen::Vector2f& ray) { return std::isnan(ray.x()); });
  if (std::find(outside.begin(), outside.end(), true) == outside.end()) outside.clear();
  return outside;
}

}  // namespace efm
