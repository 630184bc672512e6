// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <optional>
#include <vector>

#include "mapping/geometry/rig.h"
#include "mapping/geometry/rigid3.h"

namespace efm {

/// The pixels of a sensor.
struct CameraSize {
  int width = 0;
  int height = 0;
};

/// The size of a sensor whose size nobody knows: events have no pixel beyond it.
inline constexpr CameraSize kUnknownSize = {65'535, 65'535};

/// The size, where it is known.
inline std::optional<CameraSize> knownSize(const CameraSize& size) {
  const bool is_known = size.width < kUnknownSize.width || size.height < kUnknownSize.height;
  return is_known ? std::optional(size) : std::nullopt;
}
inline std::optional<CameraSize> knownSize(const CameraModel& model) {
  return knownSize(CameraSize{model.width, model.height});
}

/// A rig's calibration from a file of its own.
struct Calibration {
  std::filesystem::path file;
  Rig rig;  ///< Cameras have no width and height where the file has none.
  /// Poses of other sensors, if the file has them. Hand-eye files refer to them.
  std::optional<Rigid3> T_imu_rig{};
  std::optional<Rigid3> T_camRect1_rig{};  ///< DSEC's rectified left frame camera.

  /// Camera `index` of the recording.
  /// @param sensor the camera's size, if the recording knows it.
  RigCamera camera(std::size_t index, const std::optional<CameraSize>& sensor) const;

  /// @throws std::invalid_argument naming the file, where it has more or fewer cameras.
  void requireCameras(std::size_t count) const;

  /// @param recorded the recording's own cameras.
  void requireLike(const Rig& recorded) const;
};

/// What `readCalibration` accepts, for errors.
inline constexpr const char* kCalibrationFiles =
    "a Kalibr camera chain, DSEC's cam_to_cam.yaml, TUM-VIE's camera-calibration*.json, "
    "camera_info YAML of ROS, an .ini file of MRPT's camera calibration, or nine numbers, fx fy cx "
    "cy k1 k2 p1 p2 k3";

/// Reads a calibration, whose kind is found by its content: see `readCamchain`,
/// `readDsecCalibration`, `readTumVieCalibration`, `readCameraInfo`, `readMrptCameras` and
/// `readUzhCalibration`; the last one does not have the sensor's size.
Calibration readCalibration(const std::filesystem::path& file);

/// Reads the nine numbers fx fy cx cy k1 k2 p1 p2 k3, the UZH data sets' calib.txt: distortion is
/// radtan with five coefficients, even where all are zero. The file does not have the sensor's
/// size: width and height are 0.
Calibration readUzhCalibration(const std::filesystem::path& file);

/// A radtan lens without the sensor's size, which is not in the file.
/// @param k fx fy cx cy.
/// @throws std::runtime_error naming the file, where `CameraModel::validate` refuses the lens.
CameraModel radtanLens(const std::filesystem::path& file, const std::vector<double>& k,
                       std::vector<double> coefficients);

/// Reads the rig's pose on the tracked body, whose poses a recording has:
///   T_world_rig = T_world_body * T_body_rig.
/// The kind of the file is found by its content:
/// - YAML with T_body_rig, 4x4, from the rig's frame to the body's; other keys are ignored.
/// - A Kalibr camera chain: the body is the IMU, see `readCamchainImu`.
/// - DSEC's cam_to_lidar.yaml: the body is the LiDAR, see `readDsecHandEye`.
/// - TUM-VIE's mocap-imu-calibration*.json: the body is the marker, see `readTumVieHandEye`.
/// Rotations may be off by 1e-3, because of rounding; the nearest rotation is taken.
/// @param calibration the rig's, which the last two need; null: none is given.
Rigid3 readHandEye(const std::filesystem::path& file, const Calibration* calibration = nullptr);

}  // namespace efm
