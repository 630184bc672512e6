// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <vector>

#include "plugin/recordings/streams/recording_parts.h"

namespace efm {

/// The text layout of the UZH event camera dataset (Mueggler et al., IJRR 2017), one camera:
///   events.txt        t x y p; other names and columns: `eventFileIn`, `findEventColumns`
///   groundtruth.txt   t px py pz qx qy qz qw, T_world_cam
///   calib.txt         fx fy cx cy k1 k2 p1 p2 k3
///   images.txt        t file, optional: the size of an image is the sensor's.

/// Whether the folder has events.
bool looksLikeUzhFolder(const std::filesystem::path& folder);

/// @throws std::runtime_error naming the file (and line) that is missing or wrong.
RecordingParts openUzhFolder(const std::vector<std::filesystem::path>& folders,
                             const ReaderOptions& options);

/// The size of the first existing image of images.txt. Without one 240x180: the whole dataset was
/// recorded with a DAVIS240C.
/// @throws std::runtime_error if the image cannot be read.
CameraSize uzhSensorSize(const std::filesystem::path& folder);

}  // namespace efm
