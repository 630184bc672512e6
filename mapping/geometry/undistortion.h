// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <cstddef>
#include <vector>

#include "mapping/geometry/camera.h"

namespace efm {

/// The viewing ray of every pixel of one camera: computed once, then looked up per event.
///
/// Stored as floats: a look-up is a random access to memory, and the smaller table fits the caches
/// better. The relative rounding error of a ray is at most 2^-25: 2e-5 pixels at the corner of an
/// HD image.
class UndistortionTable {
 public:
  /// Cost: one inversion of the lens per pixel, some 50 ns of processor time, rows in parallel on
  /// the threads of the caller's task arena; memory: 8 bytes per pixel.
  /// @throws std::invalid_argument where the model is not valid, or no pixel has a ray.
  explicit UndistortionTable(const CameraModel& model);

  int width() const { return width_; }
  int height() const { return height_; }

  /// (X/Z, Y/Z) of the ray through the centre of raw pixel (x, y), frame `cam`; not a number (both)
  /// where the pixel lies outside the lens (`LensInverse`).
  Eigen::Vector2d ray(int x, int y) const {
    const auto row = static_cast<std::size_t>(y) * static_cast<std::size_t>(width_);
    return rays_[row + static_cast<std::size_t>(x)].cast<double>();
  }
  bool hasRay(int x, int y) const { return !std::isnan(ray(x, y).x()); }
  /// The ray of (x, y), or else of the first pixel that has one on the way from there to the
  /// optical axis.
  Eigen::Vector2d rayNear(int x, int y) const;
  /// Per pixel, row-major: whether it lies outside the lens. Empty where none does.
  std::vector<bool> outsideLens() const;
  /// The rays of all pixels, row-major: pixel (x, y) has element y * width() + x.
  const Eigen::Vector2f* rays() const { return rays_.data(); }

 private:
  int width_ = 0;
  int height_ = 0;
  int center_x_ = 0;  // has a ray
  int center_y_ = 0;
  std::vector<Eigen::Vector2f> rays_;  // row-major
};

}  // namespace efm
