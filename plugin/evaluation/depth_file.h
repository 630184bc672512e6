// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <opencv2/core.hpp>

#include <filesystem>
#include <optional>

namespace efm {

/// Reads a depth map: a float32 TIFF of one channel, a grey PFM or a NumPy array of two dimensions
/// (float32, float64), in metres; or a 16-bit PNG with a scale. The name of the file has no effect.
/// @param png_scale above 0, for PNG only. From 1: units per metre (1000: millimetres; 256: KITTI;
/// 5000: TUM RGB-D). Below 1: metres per unit.
/// @return the values of the file. A value that is 0, negative or not finite means no depth
/// (`isDepth`).
cv::Mat1f readDepthFile(const std::filesystem::path& file,
                        std::optional<double> png_scale = std::nullopt);

/// Reads a mask from a PNG or TIFF image (`decodePicture`): 0 for black pixels, 255 for others.
cv::Mat1b readMaskFile(const std::filesystem::path& file);

}  // namespace efm
