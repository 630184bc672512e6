// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <memory>
#include <vector>

#include "plugin/recordings/bags/bag_source.h"

namespace efm {

/// Whether a file or folder is a bag of ROS 1. Never throws.
bool isRos1Bag(const std::filesystem::path& file);
/// Whether it is a bag of ROS 2: a database, an MCAP file, either compressed as a whole, or a
/// folder with metadata.yaml.
bool isRos2Bag(const std::filesystem::path& source);

/// The bags of a file, or of a folder's metadata.yaml in its order.
/// @throws std::runtime_error naming the file, also for a compressed one and for one that this
/// build does not read.
std::vector<std::shared_ptr<BagSource>> openBagFiles(const std::filesystem::path& source);

}  // namespace efm
