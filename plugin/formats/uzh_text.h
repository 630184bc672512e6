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
///   images.txt        t file, optional; an image tells the sensor's size.

/// Whether it is a folder with an events.txt. `openUzhFolder` reports other missing files.
bool looksLikeUzhFolder(const std::filesystem::path& folder);

/// @throws std::runtime_error naming the file that is missing, or the file and line with an error;
/// std::invalid_argument if a given calibration has more cameras or a camera of another size.
std::unique_ptr<Recording> openUzhFolder(const std::filesystem::path& folder,
                                         const RecordingOverrides& given = {});

/// The size of the first image of images.txt that exists. Without an image it is 240x180: the whole
/// data set was recorded with a DAVIS240C.
/// @throws std::runtime_error if the image cannot be read.
CameraSize uzhSensorSize(const std::filesystem::path& folder);

}  // namespace efm
