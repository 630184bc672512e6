// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>

#include "mapping/geometry/rigid3.h"
#include "plugin/recordings/calibration/calibration_file.h"

namespace efm {

/// Reads the rig's pose on the tracked body, whose poses a recording has:
///   T_world_rig = T_world_body * T_body_rig.
/// The kind of the file is found by its content:
/// - YAML with T_body_rig, 4x4, from the rig's frame to the body's; other keys are ignored.
/// - A Kalibr camera chain: the body is the IMU, see `readCamchainImu`.
/// - DSEC's cam_to_lidar.yaml: the body is the LiDAR, see `readDsecHandEye`.
/// - TUM-VIE's mocap-imu-calibration*.json: the body is the marker, see `readTumVieHandEye`.
/// Rotations may be off by 1e-3, because of rounding; the nearest rotation is taken.
/// @param calibration the rig's, which the last two need; null: none is given.
/// @throws std::runtime_error naming the file, the key, the value and what was expected.
Rigid3 readHandEye(const std::filesystem::path& file, const Calibration* calibration = nullptr);

}  // namespace efm
