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
  Rig rig;  ///< Cameras without width and height where the file does not say them.

  /// Camera `index` of the recording.
  /// @param sensor its size where the recording knows it.
  /// @throws std::invalid_argument naming the file, where it has no such camera, has one of another
  /// size, or nothing says the size.
  RigCamera camera(std::size_t index, const std::optional<CameraSize>& sensor) const;

  /// @throws std::invalid_argument naming the file, where it has more or fewer cameras.
  void requireCameras(std::size_t count) const;

  /// @param recorded the recording's own cameras, which this can take the place of.
  /// @throws std::invalid_argument naming the file, where it has more or fewer cameras or one of
  /// another size.
  void requireLike(const Rig& recorded) const;
};

/// Reads a camera chain as `readCamchain` does, or nine numbers as `readUzhCalibration` does, which
/// leave the sensor's size open.
/// @throws std::runtime_error naming the file, the place, the value and what was expected.
Calibration readCalibration(const std::filesystem::path& file);

/// Reads the nine numbers fx fy cx cy k1 k2 p1 p2 k3, the UZH data sets' calib.txt: distortion is
/// radtan with five coefficients, even where all are zero.
/// @throws std::runtime_error naming the file, the value or the count, and what was expected.
CameraModel readUzhCalibration(const std::filesystem::path& file, CameraSize size);

}  // namespace efm
