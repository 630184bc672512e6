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

/// Whether it is a folder with an events.txt; what else is missing is for `openUzhFolder` to say.
bool looksLikeUzhFolder(const std::filesystem::path& folder);

/// @throws std::runtime_error naming the file (and line) that is missing or not understood;
/// std::invalid_argument where a given calibration has more cameras or one of another size.
std::unique_ptr<Recording> openUzhFolder(const std::filesystem::path& folder,
                                         const RecordingOverrides& given = {});

/// That of the first image of images.txt that exists, or else 240x180: the DAVIS240C, which
/// recorded the whole data set.
/// @throws std::runtime_error where that image cannot be read.
CameraSize uzhSensorSize(const std::filesystem::path& folder);

}  // namespace efm
