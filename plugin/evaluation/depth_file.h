// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <opencv2/core.hpp>

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string_view>

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

/// The maximum width and height of a PFM or NumPy image. More means a damaged header.
inline constexpr std::uint64_t kMaxImageSide = 65535;

/// The image of a NumPy array (`parseNpyHeader`): two dimensions, [row][column], float32 or
/// float64 of either byte order, in C order. Doubles are rounded to float.
cv::Mat1f parseNpy(std::string_view bytes);

/// Whether these are the first bytes of a PFM ("portable float map", Debevec), grey or coloured.
bool looksLikePfm(std::string_view bytes);

/// The image of a grey PFM: lines "Pf", "width height" and "scale", then float32 rows from the
/// bottom upwards, little endian if the scale is negative. As in stereo benchmarks (Middlebury),
/// the size of the scale has no effect. (OpenCV's reader divides by it and refuses CRLF line ends.)
cv::Mat1f parsePfm(std::string_view bytes);

}  // namespace efm
