// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/session/camera_view.h"

#include <cmath>

namespace efm {

bool isCalibrated(const CameraModel& model) { return model.fx > 0 && model.fy > 0; }

Eigen::Vector2d fieldOfView(const CameraModel& model) {
  const Eigen::Vector2d half{0.5 * model.width / model.fx, 0.5 * model.height / model.fy};
  if (model.distortion == DistortionModel::kEquidistant) return 2 * half;
  return {2 * std::atan(half.x()), 2 * std::atan(half.y())};
}

double baselineOf(const RigCamera& a, const RigCamera& b) {
  return (a.T_rig_cam.translation - b.T_rig_cam.translation).norm();
}

}  // namespace efm
