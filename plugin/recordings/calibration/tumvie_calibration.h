// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "plugin/recordings/calibration/calibration_file.h"
#include "plugin/recordings/calibration/yaml_entry.h"

namespace efm {

/// TUM-VIE (Klenk et al., IROS 2021): JSON whose keys are below `value0`. Of its four cameras, 2
/// and 3 are the event cameras. JSON is read as YAML, which contains it.

/// Reads the rig of the event cameras from camera-calibration*.json: `intrinsics` (camera_type
/// kb4, which is equidistant: fx … k4), `resolution`, `T_imu_cam` {px … qw}. T_imu_rig is T_imu_cam
/// of camera 2.
/// @throws std::runtime_error naming file, entry, key, value and what was expected.
Calibration readTumVieCalibration(const YamlEntry& root, const std::filesystem::path& file);

/// Reads the pose of the rig on the motion-capture marker from mocap-imu-calibration*.json:
///   T_marker_rig = T_imu_marker^-1 * T_imu_rig.
/// @param calibration of the same rig; null: none is given.
/// @throws std::runtime_error where the calibration has no IMU, or a key is wrong.
Rigid3 readTumVieHandEye(const YamlEntry& root, const Calibration* calibration);

}  // namespace efm
