// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <vector>

#include "mapping/camera.h"

namespace efm {

/// The viewing ray of every pixel of one camera, computed once through OpenCV's iterative
/// undistortion and looked up per event.
class UndistortionTable {
 public:
  /// Cost: one undistortion per pixel; memory: 16 bytes per pixel.
  /// @throws std::invalid_argument where the model is not valid.
  explicit UndistortionTable(const CameraModel& model);

  int width() const { return width_; }
  int height() const { return height_; }

  /// (X/Z, Y/Z) of the ray through the centre of raw pixel (x, y), frame `cam`.
  const Eigen::Vector2d& ray(int x, int y) const {
    return rays_[static_cast<std::size_t>(y) * static_cast<std::size_t>(width_) +
                 static_cast<std::size_t>(x)];
  }

 private:
  int width_ = 0;
  int height_ = 0;
  std::vector<Eigen::Vector2d> rays_;  // row-major
};

}  // namespace efm
