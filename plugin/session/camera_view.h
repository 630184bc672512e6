// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>

#include "mapping/geometry/rig.h"

namespace efm {

/// Whether a recording knows the camera's calibration. Without one, the focal length is 0.
bool isCalibrated(const CameraModel& model);

/// Horizontal and vertical field of view, radians: of the pinhole, or, for a fisheye lens, of its
/// angles in proportion to the distance from the centre. The distortion is left out, so it is
/// defined for any coefficients.
Eigen::Vector2d fieldOfView(const CameraModel& model);

/// Distance of two cameras on the rig, metres.
double baselineOf(const RigCamera& a, const RigCamera& b);

}  // namespace efm
