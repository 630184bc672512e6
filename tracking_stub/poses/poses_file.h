// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <vector>

#include "mapping/geometry/trajectory.h"

namespace efm {

/// The poses of a recording, TUM format, as `readTumTrajectory` gives them: T_world_rig.
/// @throws std::runtime_error as that does, and naming the file where it holds no pose.
std::vector<StampedPose> readPosesFile(const std::filesystem::path& file);

}  // namespace efm
