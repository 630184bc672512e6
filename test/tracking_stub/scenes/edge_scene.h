// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cmath>
#include <memory>

#include "tracking_stub/sensor/simulated_rig.h"

namespace efm::test {

/// Returns the painter of a surface with one log intensity.
inline Scene::Painter evenPaint(float log_intensity) {
  return [log_intensity](double, double) { return Texture(cv::Mat1f(8, 8, log_intensity), 0.1); };
}

/// Returns the painter of an edge along v: log intensity 0 if u is below `edge_u_m`, otherwise
/// `contrast`. The edge must be on the border of a texel.
inline Scene::Painter edgePaint(double edge_u_m, float contrast, double texel_m) {
  return [=](double width_m, double height_m) {
    cv::Mat1f painting(static_cast<int>(std::lround(height_m / texel_m)),
                       static_cast<int>(std::lround(width_m / texel_m)), 0.0F);
    painting.colRange(static_cast<int>(std::lround(edge_u_m / texel_m)), painting.cols) = contrast;
    return Texture(painting, texel_m);
  };
}

/// Returns a wall at the z-depth `depth_m` of a camera at the origin: u = x + width/2 and v =
/// height/2 - y, frame `world` (x right, y down, z forward).
inline Rectangle facingWall(double depth_m, double width_m, double height_m) {
  return {{-width_m / 2, height_m / 2, depth_m},
          Eigen::Vector3d::UnitX(),
          -Eigen::Vector3d::UnitY(),
          width_m,
          height_m};
}

/// A straight motion at constant speed from the origin, without rotation.
class StraightMotion : public Motion {
 public:
  explicit StraightMotion(const Eigen::Vector3d& velocity) : velocity_(velocity) {}
  Rigid3 poseAt(std::int64_t t_ns) const override {
    Rigid3 T_world_rig;
    T_world_rig.translation = velocity_ * (static_cast<double>(t_ns) * 1e-9);
    return T_world_rig;
  }

 private:
  Eigen::Vector3d velocity_;
};

inline RigCamera smallCamera() {
  RigCamera camera;
  camera.model.width = 64;
  camera.model.height = 48;
  camera.model.fx = camera.model.fy = 50;
  camera.model.cx = 31.5;
  camera.model.cy = 23.5;
  return camera;
}

}  // namespace efm::test
