// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <opencv2/core.hpp>
#include <optional>

namespace efm {

/// Reads a depth map, whatever its name: a float32 TIFF of one channel, a grey PFM or a NumPy array
/// of two dimensions (float32, float64), in metres; or a 16-bit PNG with a scale.
/// @param png_scale units per metre where it is 1 or more (1000: millimetres; 256: KITTI; 5000:
/// TUM RGB-D), metres per unit where it is less; above 0. Matters for PNG alone.
/// @return the values as they are: what is 0, negative or not finite means no depth (`isDepth`).
/// @throws std::runtime_error naming the file and what is wrong with it; std::invalid_argument
/// where the scale is not above 0.
cv::Mat1f readDepthFile(const std::filesystem::path& file,
                        std::optional<double> png_scale = std::nullopt);

/// Reads a mask from an image that OpenCV knows: 255 where it is not black, else 0.
/// @throws std::runtime_error naming the file that cannot be read.
cv::Mat1b readMaskFile(const std::filesystem::path& file);

}  // namespace efm
