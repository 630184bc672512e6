// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "mapping/geometry/rig.h"
#include "plugin/recordings/calibration/yaml_entry.h"

namespace efm {

/// Reads a camera from the keys camera_model (pinhole), distortion_model (radtan, equidistant or
/// none), distortion_coeffs and resolution, and the four intrinsics fx fy cx cy.
/// @param intrinsics_key "intrinsics" in Kalibr's files, "camera_matrix" in DSEC's.
/// @throws std::runtime_error naming file, entry, key, value and what was expected.
CameraModel readKalibrCamera(const YamlEntry& entry, const char* intrinsics_key);

/// Sets the size of the sensor.
/// @param key of the size, for errors.
/// @throws std::runtime_error unless both are whole numbers from 1 to 65535.
void setSensorSize(const YamlEntry& entry, const char* key, double width, double height,
                   CameraModel& model);

/// @throws std::runtime_error naming the entry, where `CameraModel::validate` refuses the model.
void requireValid(const YamlEntry& entry, const CameraModel& model);

}  // namespace efm
