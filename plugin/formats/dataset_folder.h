// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <memory>

#include "plugin/calibration/calibration_file.h"
#include "plugin/recordings/recording.h"

namespace efm {

/// The project's own text layout, which `event-fusion simulate` writes:
///   camchain.yaml     the rig
///   camN/events.txt   t x y p, for each camera of the rig; a silent camera's may be empty
///   poses.txt         or else groundtruth.txt: t tx ty tz qx qy qz qw, T_world_cam0
/// Other files do not matter.

/// Whether it is a folder with a camchain.yaml or a cam0/events.txt; what else is missing is for
/// `openDatasetFolder` to say.
bool looksLikeDatasetFolder(const std::filesystem::path& folder);

/// @throws std::runtime_error naming the file (and line) that is missing or not understood;
/// std::invalid_argument where a given calibration has more or fewer cameras or one of another
/// size.
std::unique_ptr<Recording> openDatasetFolder(const std::filesystem::path& folder,
                                             const RecordingOverrides& given = {});

}  // namespace efm
