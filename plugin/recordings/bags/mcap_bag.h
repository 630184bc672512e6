// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <memory>

#include "plugin/recordings/bags/bag_source.h"

namespace efm {

/// Opens an MCAP file: chunks without compression, lz4 or zstd, or messages without chunks. Of its
/// channels, those with CDR or ROS 1 messages are topics. Checksums of chunks and of the summary
/// are compared. A file without a summary, or whose recording was cut off, is read once from its
/// beginning to its end to find the channels and chunks.
/// @throws std::runtime_error naming the file, the byte and what was expected.
std::unique_ptr<BagSource> openMcap(const std::filesystem::path& file);

}  // namespace efm
