// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <cstddef>

#include "mapping/camera.h"

namespace efm {

/// The undistorted pinhole view that a keyframe's DSI and depth map live in: frame `ref`, x right,
/// y down, z forward. Images of it are row-major, width x height; integers are pixel centres.
struct ReferenceView {
  int width = 0;
  int height = 0;
  double fx = 0, fy = 0, cx = 0, cy = 0;  ///< Pixels.

  /// The view of a camera without its distortion: the same size and intrinsics.
  static ReferenceView of(const CameraModel& model) {
    return {model.width, model.height, model.fx, model.fy, model.cx, model.cy};
  }

  std::size_t pixels() const {
    return static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
  }

  Eigen::Vector2d project(const Eigen::Vector3d& p_ref) const {
    return {fx * p_ref.x() / p_ref.z() + cx, fy * p_ref.y() / p_ref.z() + cy};
  }
  /// The point at z-depth `depth_m` (metres) on the ray of pixel (x, y), frame `ref`.
  Eigen::Vector3d pointAt(double x, double y, double depth_m) const {
    return {(x - cx) / fx * depth_m, (y - cy) / fy * depth_m, depth_m};
  }
};

}  // namespace efm
