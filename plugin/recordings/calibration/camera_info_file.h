// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "mapping/geometry/rig.h"
#include "plugin/recordings/calibration/yaml_entry.h"

namespace efm {

/// Reads one camera from the YAML of ROS (sensor_msgs/CameraInfo as camera_calibration writes it):
///   image_width, image_height
///   camera_matrix            data: 9 numbers, fx 0 cx 0 fy cy 0 0 1
///   distortion_model         plumb_bob (radtan) | equidistant | fisheye (the same)
///   distortion_coefficients  data: 4 or 5 numbers | 4
/// Rectification and projection are ignored: events are not rectified.
/// @throws std::runtime_error naming file, key, value and what was expected.
CameraModel readCameraInfo(const YamlEntry& root);

}  // namespace efm
