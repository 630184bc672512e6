// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "plugin/recordings/calibration/calibration_file.h"
#include "plugin/recordings/calibration/yaml_entry.h"

namespace efm {

/// DSEC (Gehrig et al., RA-L 2021): two event cameras, cam0 left and cam3 right, and between them
/// two frame cameras, cam1 and cam2. p_camN = T_N(N-1) * p_cam(N-1); p_camRectN = R_rectN * p_camN.

/// Reads the rig of the event cameras from cam_to_cam.yaml: `intrinsics` (cam0, cam3) and
/// `extrinsics` (T_10, T_21, T_32, R_rect1). Its camera 1 is cam3:
///   T_rig_cam1 = (T_32 * T_21 * T_10)^-1.
/// The calibration has T_camRect1_rig = R_rect1 * T_10, which the hand-eye transform needs.
/// @throws std::runtime_error naming file, entry, key, value and what was expected.
Calibration readDsecCalibration(const YamlEntry& root, const std::filesystem::path& file);

/// Reads the pose of the rig on the LiDAR from cam_to_lidar.yaml:
///   T_lidar_rig = T_lidar_camRect1 * T_camRect1_rig.
/// @param calibration of the same rig; null: none is given.
/// @throws std::runtime_error where the calibration is not DSEC's, or the key is wrong.
Rigid3 readDsecHandEye(const YamlEntry& root, const Calibration* calibration);

}  // namespace efm
