// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <memory>

#include "plugin/recordings/bags/bag_source.h"

namespace efm {

/// Opens a ROS 1 bag of version 2.0 (wiki.ros.org/Bags/Format/2.0), uncompressed, bz2 or lz4.
///
/// Not through rosbag_storage: with flipped bits it reads beyond its buffers (9 of 200 damaged bags
/// crashed it) and takes memory without bound (274 MB for a bag of 0.8 MB); it prints; and its
/// index takes some 70 bytes for each message of the bag. Here memory holds 48 bytes for each
/// chunk.
/// @throws std::runtime_error naming the file, the byte and what was expected; for a bag without an
/// index (its recording was cut off), that `rosbag reindex` repairs it.
std::unique_ptr<BagSource> openRos1Bag(const std::filesystem::path& file);

}  // namespace efm
