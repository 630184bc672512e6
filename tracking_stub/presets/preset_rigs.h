// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Geometry>

#include "mapping/geometry/angle.h"
#include "mapping/geometry/rig.h"

namespace efm {

/// What presets put their rigs and motions together from.

inline double radians(double deg) { return deg * kPi / 180; }

/// R_world_cam of a level camera (x right, y down, z forward) that looks along y in a world whose z
/// is up.
inline Eigen::Quaterniond lookingAlongY() {
  Eigen::Matrix3d R_world_cam;
  R_world_cam << 1, 0, 0, 0, 0, 1, 0, -1, 0;
  return Eigen::Quaterniond(R_world_cam);
}

/// No distortion, the principal point in the middle.
inline CameraModel makePinhole(int width, int height, double focal_px) {
  CameraModel model;
  model.width = width;
  model.height = height;
  model.fx = model.fy = focal_px;
  model.cx = 0.5 * width;
  model.cy = 0.5 * height;
  return model;
}

/// Two alike, the second `baseline_m` to the right of the first, which is the rig's frame.
inline Rig makeStereoRig(const CameraModel& model, double baseline_m) {
  Rig rig;
  rig.cameras.resize(2);
  rig.cameras[0].model = rig.cameras[1].model = model;
  rig.cameras[1].T_rig_cam.translation = {baseline_m, 0, 0};
  return rig;
}

}  // namespace efm
