// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <opencv2/core.hpp>

#include <cstdint>
#include <filesystem>
#include <initializer_list>
#include <optional>
#include <vector>

#include "plugin/recordings/text/dataset_folder.h"

namespace efm {

/// Reads a depth map: a float32 TIFF of one channel, a grey PFM or a NumPy array of two dimensions
/// (float32, float64), in metres; or a 16-bit PNG with a scale. The name of the file has no effect.
/// @param png_scale above 0, for PNG only. From 1 on, it is units per metre (1000: millimetres;
/// 256: KITTI; 5000: TUM RGB-D). Below 1, it is metres per unit.
/// @return the values of the file. A value that is 0, negative or not finite means "no depth"
/// (`isDepth`).
cv::Mat1f readDepthFile(const std::filesystem::path& file,
                        std::optional<double> png_scale = std::nullopt);

/// Reads a mask from a PNG or TIFF image (`decodePicture`): 0 for black pixels, 255 for others.
cv::Mat1b readMaskFile(const std::filesystem::path& file);

/// Returns the first of these files that a folder has, and any other path unchanged.
std::filesystem::path fileInFolder(const std::filesystem::path& path,
                                   std::initializer_list<const char*> names);

/// Selects the estimated or the true depth maps of a folder that may hold both.
enum class DepthSeriesRole { kEstimate, kTruth };

/// Returns the depth maps of a folder, in the order of time. The folder is searched for these forms
/// in this order, with <t> in decimal seconds; the first form that has maps is used:
///   keyframes/<t>/depth.tiff or <t>/depth.tiff   written by `map`
///   depth/index.txt or index.txt                 a dataset's list, as `timedFilesIn` reads it
///   <t>.tiff or NAME_<t>.tiff                    or .tif, .pfm, .npy, .png
/// For truth, the dataset's list is searched before the maps of `map`.
std::vector<TimedFile> depthSeries(const std::filesystem::path& folder, DepthSeriesRole role);

/// A depth map and its truth are at most this time apart.
inline constexpr std::int64_t kSameTimeNs = 1'000'000;

/// Returns the file nearest in time to `t_ns`. If two files are equally near, it is the earlier
/// file. Returns null if no file is within `within_ns`.
/// @param series in the order of time.
const TimedFile* nearestFile(const std::vector<TimedFile>& series, std::int64_t t_ns,
                             std::int64_t within_ns);

}  // namespace efm
