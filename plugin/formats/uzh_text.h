// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <memory>

#include "plugin/calibration/calibration_file.h"
#include "plugin/recordings/recording.h"

namespace efm {

/// The text layout of the UZH event camera dataset (Mueggler et al., IJRR 2017), one camera:
///   events.txt        t x y p
///   groundtruth.txt   t px py pz qx qy qz qw, T_world_cam
///   calib.txt         fx fy cx cy k1 k2 p1 p2 k3
///   images.txt        t file, optional: the size of an image is the sensor's.

/// Whether the folder has an events.txt. `openUzhFolder` names other missing files.
bool looksLikeUzhFolder(const std::filesystem::path& folder);

/// @throws std::runtime_error naming the file (and line) that is missing or wrong;
/// std::invalid_argument if a given calibration has several cameras or another size.
std::unique_ptr<Recording> openUzhFolder(const std::filesystem::path& folder,
                                         const RecordingOverrides& given = {});

/// The size of the first existing image of images.txt. Without one 240x180: the whole dataset was
/// recorded with a DAVIS240C.
/// @throws std::runtime_error if the image cannot be read.
CameraSize uzhSensorSize(const std::filesystem::path& folder);

}  // namespace efm
