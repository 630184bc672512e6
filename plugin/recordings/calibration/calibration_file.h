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

/// The size that stands for an unknown size: no event has a pixel outside it.
inline constexpr CameraSize kUnknownSize = {65'535, 65'535};

/// Returns the size; std::nullopt if it is unknown.
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
  Rig rig;  ///< Cameras have width and height 0 if the file has no size.
  /// Transforms to other sensors, if the file has them. Hand-eye files refer to these sensors.
  std::optional<Rigid3> T_imu_rig{};
  std::optional<Rigid3> T_camRect1_rig{};  ///< camRect1: DSEC's rectified left frame camera.

  /// Returns camera `index` of the recording.
  /// @param sensor the camera's size, if the recording has it.
  RigCamera camera(std::size_t index, const std::optional<CameraSize>& sensor) const;

  /// Returns the calibration of a recording with fewer cameras: of those that `selected` names, if
  /// they are as many. The rig's frame stays that of camera 0.
  Calibration of(std::size_t count, const std::vector<int>& selected) const;

  /// @throws std::invalid_argument naming the file, if it has more or fewer cameras.
  void requireCameras(std::size_t count) const;

  /// Requires the number and sizes of the recording's own cameras, `recorded`.
  void requireLike(const Rig& recorded) const;
};

/// The files that `readCalibration` accepts, for errors.
inline constexpr const char* kCalibrationFiles =
    "a Kalibr camera chain, DSEC's cam_to_cam.yaml, JSON of Basalt or TUM-VIE, camera_info YAML of "
    "ROS, OpenCV, VINS or DV, JSON of Metavision or dv-processing, an .ini file of MRPT's camera "
    "calibration, .npz with mtx and dist, or nine numbers, fx fy cx cy k1 k2 p1 p2 k3 (and width "
    "height)";

/// Reads a calibration, whose kind is found by its content: see `readCamchain`,
/// `readDsecCalibration`, `readBasaltCalibration`, `readOneCamera`, `readDvCameras`,
/// `readMrptCameras` and `readUzhCalibration`; the file of `readUzhCalibration` does not have the
/// sensor's size.
Calibration readCalibration(const std::filesystem::path& file);

/// Reads the nine numbers fx fy cx cy k1 k2 p1 p2 k3, the UZH data sets' calib.txt: distortion is
/// radtan with five coefficients, even if all are zero. Two more numbers are the sensor's width and
/// height; without them, these are 0. The nine numbers of a matrix fx 0 cx, 0 fy cy, 0 0 1 are a
/// lens without distortion.
Calibration readUzhCalibration(const std::filesystem::path& file);

/// Makes a radtan lens without the sensor's size, which is not in the file.
/// @param k fx fy cx cy.
/// @throws std::runtime_error naming the file, if `CameraModel::validate` rejects the lens.
CameraModel radtanLens(const std::filesystem::path& file, const std::vector<double>& k,
                       std::vector<double> coefficients);

/// Reads the rig's pose on the tracked body, whose poses a recording has:
///   T_world_rig = T_world_body * T_body_rig.
/// The kind of the file is found by its content:
/// - YAML with T_body_rig, 4x4, from the rig's frame to the body's, or body_T_cam0 (VINS); other
///   keys are ignored.
/// - Text or a NumPy array (.npy, .npz) of these numbers alone, or of seven, x y z qx qy qz qw.
/// - The result of easy_handeye or easy_handeye2 with the eye on the hand: the body is the robot's
///   effector.
/// - A camera chain of Kalibr or OpenVINS: the body is the IMU, see `readCamchainImu`.
/// - DSEC's cam_to_lidar.yaml: the body is the LiDAR, see `readDsecHandEye`.
/// - TUM-VIE's mocap-imu-calibration*.json: the body is the marker, see `readTumVieHandEye`.
///   Rotations may have errors of 1e-3, because of rounding; the nearest rotation is taken.
/// @param calibration the rig's calibration, which the last two kinds need; null: none is given.
Rigid3 readHandEye(const std::filesystem::path& file, const Calibration* calibration = nullptr);

/// Returns whether nine numbers, row by row, are fx 0 cx, 0 fy cy, 0 0 1.
inline bool isCameraMatrix(const std::vector<double>& k) {
  return k.size() == 9 && k[1] == 0 && k[3] == 0 && k[6] == 0 && k[7] == 0 && k[8] == 1;
}

}  // namespace efm
