// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <filesystem>
#include <vector>

#include "plugin/evaluation/timed_files.h"

namespace efm {

/// What a folder's depth maps are wanted for: it may hold both kinds.
enum class DepthSeriesRole { kEstimate, kTruth };

/// The depth maps of a folder, in the order of time. The first of these that it has:
///   keyframes/<t>/depth.tiff or <t>/depth.tiff   what `map` writes
///   depth/index.txt or index.txt                 a dataset's: `t file` a line, files beside it
///   <t>.tiff, NAME_<t>.tiff                      or .tif, .pfm, .npy, .png
/// with <t> in decimal seconds. For truth, the dataset's come first.
/// @throws std::runtime_error naming the folder where it has none of these, or the line of an index
/// that is not understood.
std::vector<TimedFile> depthSeries(const std::filesystem::path& folder, DepthSeriesRole role);

/// The file nearest in time to `t_ns`, of two as near the earlier; null where none is within
/// `within_ns`.
/// @param series in the order of time.
const TimedFile* nearestFile(const std::vector<TimedFile>& series, std::int64_t t_ns,
                             std::int64_t within_ns);

}  // namespace efm
