// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <optional>

#include "mapping/geometry/rig.h"
#include "plugin/formats/event_text.h"

namespace efm {

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

/// What a folder of text files need not hold, because it was given beside it.
struct GivenParts {
  const Calibration* calibration = nullptr;  ///< Only where the folder has none; may be null.
  bool poses = false;                        ///< They are put in later.
};

/// Reads a camera chain as `readCamchain` does, or nine numbers as `readUzhCalibration` does, which
/// leave the sensor's size open.
/// @throws std::runtime_error naming the file, the place, the value and what was expected.
Calibration readCalibration(const std::filesystem::path& file);

}  // namespace efm
