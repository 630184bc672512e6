// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <memory>

#include "plugin/recordings/bags/bag_source.h"

namespace efm {

/// Opens a ROS 2 bag in SQLite: tables `topics` and `messages`, of any version of rosbag2.
/// @throws std::runtime_error naming the file and what was expected.
std::unique_ptr<BagSource> openDb3(const std::filesystem::path& file);

}  // namespace efm
