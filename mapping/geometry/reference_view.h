// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <optional>

#include "mapping/geometry/camera.h"

namespace efm {

/// The undistorted pinhole view of a keyframe's DSI and depth map. Frame `ref`: x right, y down, z
/// forward. Images are row-major, width x height; integer coordinates are pixel centres.
struct ReferenceView {
  int width = 0;
  int height = 0;
  double fx = 0, fy = 0, cx = 0, cy = 0;  ///< Pixels.

  /// A camera's view without distortion: the same size and intrinsics.
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

struct ReferenceViewOptions {
  /// Horizontal field of view in degrees, above 0 and below 180. Pixels keep the camera's aspect
  /// ratio, the principal point is the image's centre. Not given: the camera's own intrinsics.
  std::optional<double> fov_deg;
  /// Size in pixels, 1 to 65,535 each, at most 2^26 pixels in all. Not given: the camera's. If only
  /// one is given, the other follows by the camera's aspect ratio.
  std::optional<int> width;
  std::optional<int> height;
  /// Shift along the view's own axes (x right, y down, z forward), metres.
  Eigen::Vector3d offset_m = Eigen::Vector3d::Zero();

  /// @throws std::invalid_argument naming the field, its value and the allowed range.
  void validate() const;
};

/// A camera's view without distortion, with the field of view and size of the options. A size
/// without a field of view keeps the camera's: the same image at another resolution.
/// @throws std::invalid_argument where the options are not valid.
ReferenceView makeReferenceView(const CameraModel& model, const ReferenceViewOptions& options);

}  // namespace efm
