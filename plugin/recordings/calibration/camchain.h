// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <optional>

#include "mapping/geometry/rig.h"

namespace efm {

/// Reads a rig from a camera chain as Kalibr writes it (YAML): cam0, cam1, … without gaps, each
/// with
///   camera_model       pinhole
///   intrinsics         [fx, fy, cx, cy]
///   distortion_model   radtan | equidistant | none
///   distortion_coeffs  4 or 5 | 4 | 0 numbers (optional for none)
///   resolution         [width, height]
///   T_cn_cnm1          4x4, for cameras after the first: from the camera before it to this one
///   timeshift_cam_imu  seconds, optional: t_imu = t_cam + timeshift_cam_imu.
/// The rig's frame and clock are camera 0's: a camera's time offset is its timeshift minus that of
/// camera 0. Other keys are ignored. Rotations may be off by 1e-3, because of
/// rounding; the nearest rotation is taken.
/// @throws std::runtime_error naming the file, the camera, the key, the value and what was
/// expected.
Rig readCamchain(const std::filesystem::path& file);

/// The pose T_imu_rig of the rig, camera 0, on the IMU: the inverse of camera 0's T_cam_imu (4x4).
/// @return nothing if the camera chain does not have it.
/// @throws std::runtime_error as `readCamchain` does.
std::optional<Rigid3> readCamchainImu(const std::filesystem::path& file);

}  // namespace efm
