// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <memory>

#include "plugin/calibration/calibration_file.h"
#include "plugin/recordings/recording.h"

namespace efm {

/// The project's own text layout, which `event-fusion simulate` writes:
///   camchain.yaml     the rig
///   camN/events.txt   t x y p, for each camera of the rig; empty for a silent camera
///   poses.txt         or groundtruth.txt: t tx ty tz qx qy qz qw, T_world_cam0
/// Other files are ignored.

/// Whether the folder has a camchain.yaml or a cam0/events.txt. `openDatasetFolder` names other
/// missing files.
bool looksLikeDatasetFolder(const std::filesystem::path& folder);

/// @throws std::runtime_error naming the file (and line) that is missing or wrong;
/// std::invalid_argument if a given calibration has another number of cameras or a camera of
/// another size.
std::unique_ptr<Recording> openDatasetFolder(const std::filesystem::path& folder,
                                             const RecordingOverrides& given = {});

}  // namespace efm
