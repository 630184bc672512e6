// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <vector>

#include "mapping/geometry/camera.h"

namespace efm {

/// (X/Z, Y/Z) of the rays through the centres of the raw pixels of row `y`, frame `cam`.
std::vector<Eigen::Vector2d> viewingRays(const CameraModel& model, int y);

/// The viewing ray of every pixel of one camera: computed once by OpenCV's iterative undistortion,
/// then looked up per event.
///
/// Stored as floats: a look-up is a random access to memory, and the smaller table fits the caches
/// better. The relative rounding error of a ray is at most 2^-25: 2e-5 pixels at the corner of an
/// HD image.
class UndistortionTable {
 public:
  /// Cost: one undistortion per pixel; memory: 8 bytes per pixel.
  /// @throws std::invalid_argument where the model is not valid.
  explicit UndistortionTable(const CameraModel& model);

  int width() const { return width_; }
  int height() const { return height_; }

  /// (X/Z, Y/Z) of the ray through the centre of raw pixel (x, y), frame `cam`.
  Eigen::Vector2d ray(int x, int y) const {
    const auto row = static_cast<std::size_t>(y) * static_cast<std::size_t>(width_);
    return rays_[row + static_cast<std::size_t>(x)].cast<double>();
  }
  /// The rays of all pixels, row-major: pixel (x, y) has element y * width() + x.
  const Eigen::Vector2f* rays() const { return rays_.data(); }

 private:
  int width_ = 0;
  int height_ = 0;
  std::vector<Eigen::Vector2f> rays_;  // row-major
};

}  // namespace efm
