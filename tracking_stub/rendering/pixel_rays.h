// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <limits>
#include <vector>

#include "mapping/geometry/rig.h"
#include "tracking_stub/rendering/scene_view.h"

namespace efm {

/// The viewing ray (X/Z, Y/Z) of a raw pixel's centre, and its change across the pixel. Not numbers
/// where the pixel lies outside the lens: it is dark.
struct PixelRay {
  Eigen::Vector2d ray = Eigen::Vector2d::Constant(std::numeric_limits<double>::quiet_NaN());
  Eigen::Vector2d per_x = ray;  ///< Per pixel to the right.
  Eigen::Vector2d per_y = ray;  ///< Per pixel down.
  double pitch = 0;             ///< Size of the pixel in units of the ray.

  /// The ray of a point in the pixel. The offsets from the centre are -0.5 to 0.5.
  Eigen::Vector2d at(double dx, double dy) const { return ray + dx * per_x + dy * per_y; }
};

/// The viewing rays of all pixels of a camera, with distortion.
class PixelRays {
 public:
  /// @throws std::invalid_argument where the model is not valid, has fewer than 2x2 pixels, or
  /// no pixel has a ray.
  explicit PixelRays(const CameraModel& model);

  int width() const { return width_; }
  int height() const { return height_; }
  const PixelRay& operator()(int x, int y) const {
    return rays_[static_cast<std::size_t>(y) * static_cast<std::size_t>(width_) +
                 static_cast<std::size_t>(x)];
  }
  /// Bounds of all rays of all pixels.
  const RayBounds& bounds() const { return bounds_; }

 private:
  int width_;
  int height_;
  std::vector<PixelRay> rays_;  // row-major
  RayBounds bounds_;
};

}  // namespace efm
