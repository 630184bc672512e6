// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <optional>

#include "mapping/geometry/rig.h"

namespace efm {

/// The pixels of a sensor.
struct CameraSize {
  int width = 0;
  int height = 0;
};

/// A rig's calibration from a file of its own.
struct Calibration {
  std::filesystem::path file;
  Rig rig;  ///< Cameras have no width and height where the file has none.

  /// Camera `index` of the recording.
  /// @param sensor the camera's size, if the recording knows it.
  /// @throws std::invalid_argument naming the file, where it has no such camera, the camera has
  /// another size, or the size is unknown.
  RigCamera camera(std::size_t index, const std::optional<CameraSize>& sensor) const;

  /// @throws std::invalid_argument naming the file, where it has more or fewer cameras.
  void requireCameras(std::size_t count) const;

  /// @param recorded the recording's own cameras.
  /// @throws std::invalid_argument naming the file, where it has another number of cameras or a
  /// camera of another size.
  void requireLike(const Rig& recorded) const;
};

/// Reads a camera chain as `readCamchain` does, or nine numbers as `readUzhCalibration` does; these
/// do not have the sensor's size.
/// @throws std::runtime_error naming the file, the line, the value and what was expected.
Calibration readCalibration(const std::filesystem::path& file);

/// Reads the nine numbers fx fy cx cy k1 k2 p1 p2 k3, the UZH data sets' calib.txt: distortion is
/// radtan with five coefficients, even where all are zero.
/// @throws std::runtime_error naming the file, the value or the count, and what was expected.
CameraModel readUzhCalibration(const std::filesystem::path& file, CameraSize size);

}  // namespace efm
