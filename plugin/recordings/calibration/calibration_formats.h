// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <optional>
#include <string_view>

#include "mapping/geometry/rig.h"
#include "plugin/recordings/calibration/calibration_file.h"
#include "plugin/recordings/calibration/yaml_entry.h"

namespace efm {

/// Reads a rig from a camera chain as Kalibr writes it (YAML): cam0, cam1, … without gaps, each
/// with
///   camera_model       pinhole
///   intrinsics         [fx, fy, cx, cy]
///   distortion_model   radtan | equidistant | none
///   distortion_coeffs  4 or 5 | 4 | 0 numbers (optional for none)
///   resolution         [width, height]
///   T_cn_cnm1          4x4, for cameras after the first: from the camera before it to this one;
///                      or T_imu_cam (OpenVINS)
///   timeshift_cam_imu  seconds, optional: t_imu = t_cam + timeshift_cam_imu.
/// The rig's frame and clock are those of camera 0: a camera's time offset is its timeshift minus
/// the timeshift of camera 0. Other keys are ignored. Rotations may have errors of 1e-3, because of
/// rounding; the nearest rotation is taken.
Rig readCamchain(const std::filesystem::path& file);

/// Reads T_imu_rig, the rig's pose on the IMU: the inverse of camera 0's T_cam_imu (4x4), or its
/// T_imu_cam (OpenVINS). @return std::nullopt if the camera chain has neither.
std::optional<Rigid3> readCamchainImu(const std::filesystem::path& file);

/// Reads the file of one camera, from the keys that its program writes: the table kOneCamera has
/// Metavision, camera_calibration of ROS, OpenCV, messages of CameraInfo, VINS, camodocal and
/// nerfstudio; and the only camera of DV's XML, which has OpenCV's keys below the camera's name.
/// Rectification and projection are ignored: events are not rectified.
/// @return std::nullopt for the file of another program.
std::optional<CameraModel> readOneCamera(const YamlEntry& root);

/// Reads the rig from the JSON of dv-processing: `cameras`, each with transformationToC0 (16
/// numbers, row by row: T_rig_cam).
Rig readDvCameras(const YamlEntry& root);

/// Reads the camera's pose on the robot's effector, from the result of easy_handeye
/// (`transformation` with x y z qx qy qz qw) or easy_handeye2 (`transform`).
Rigid3 readEasyHandEye(const YamlEntry& root);

/// DSEC (Gehrig et al., RA-L 2021): two event cameras, cam0 left and cam3 right, and between them
/// two frame cameras, cam1 and cam2. p_camN = T_N(N-1) * p_cam(N-1); p_camRectN = R_rectN * p_camN.

/// Reads the rig of the event cameras from cam_to_cam.yaml: `intrinsics` (cam0, cam3) and
/// `extrinsics` (T_10, T_21, T_32, R_rect1). Camera 1 of the rig is cam3:
///   T_rig_cam1 = (T_32 * T_21 * T_10)^-1.
/// The calibration has T_camRect1_rig = R_rect1 * T_10, which the hand-eye transform needs.
Calibration readDsecCalibration(const YamlEntry& root, const std::filesystem::path& file);

/// Reads the pose of the rig on the LiDAR from cam_to_lidar.yaml:
///   T_lidar_rig = T_lidar_camRect1 * T_camRect1_rig.
/// @param calibration calibration of the same rig; null: none is given.
Rigid3 readDsecHandEye(const YamlEntry& root, const Calibration* calibration);

/// Basalt and TUM-VIE (Klenk et al., IROS 2021): JSON whose keys are below `value0`. JSON is a part
/// of YAML, and is read as YAML.

/// Reads a rig from Basalt's calibration.json or TUM-VIE's camera-calibration*.json: `intrinsics`
/// (camera_type kb4, which is equidistant: fx … k4), `resolution`, `T_imu_cam` {px … qw}. If there
/// are four cameras and the last two have another resolution, these are the event cameras of
/// TUM-VIE, else all are. T_imu_rig is T_imu_cam of the first one.
Calibration readBasaltCalibration(const YamlEntry& root, const std::filesystem::path& file);

/// Reads the pose of the rig on the motion-capture marker from mocap-imu-calibration*.json:
///   T_marker_rig = T_imu_marker^-1 * T_imu_rig.
/// @param calibration calibration of the same rig; null: none is given.
Rigid3 readTumVieHandEye(const YamlEntry& root, const Calibration* calibration);

/// Returns whether a text begins, after comments, with a section of an .ini file: "[NAME]".
bool looksLikeIni(std::string_view text);

/// Reads a camera, or two, from an .ini file as MRPT's camera calibration writes it (`TCamera`,
/// `TStereoCamera`): one section of any name, or the sections NAME_LEFT, NAME_RIGHT and
/// NAME_LEFT2RIGHT_POSE. The keys of a camera:
///   resolution        [width height]
///   fx fy cx cy       pixels
///   distortion_model  none | plumb_bob (radtan) | kannala_brandt (equidistant); also `distortion`
///   dist              [k1 k2 p1 p2 k3 …], more than five only if they are 0 | [k1 k2 k3 k4]
/// The key of the pose of the right camera on the left camera:
///   pose_quaternion   [x y z qw qx qy qz]
/// Other keys and sections are ignored. The left camera is camera 0.
Rig readMrptCameras(std::string_view text, const std::filesystem::path& file);

}  // namespace efm
