// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <opencv2/core.hpp>

#include <string>
#include <string_view>

namespace efm {

/// How a PNG is compressed.
enum class PngPacking {
  kRuns,   ///< Runs of equal differences from left to right.
  kQuick,  ///< zlib's level 1. For figures a third of the size, in the same time.
  kSmall,  ///< zlib's level 6. For depth maps half the size of kRuns, three times as long.
};

/// The bytes of a PNG file.
/// @param picture 8-bit, grey or BGR.
std::string encodePng(const cv::Mat& picture, PngPacking packing);

/// The bytes of a float32 TIFF file, without compression.
std::string encodeTiff(const cv::Mat1f& image);

/// Whether these are the first bytes of a PNG.
bool looksLikePng(std::string_view bytes);
/// Whether these are the first bytes of a TIFF, also of one above 4 GB (BigTIFF).
bool looksLikeTiff(std::string_view bytes);

/// The pixels of a PNG or TIFF file, at most 2^26. PNG: 8 or 16 bits, grey, BGR or BGRA; a palette
/// becomes colours. TIFF: samples of 8 or 16 bits, float32 or float64, grey, BGR or BGRA.
/// @throws std::runtime_error where the file is damaged or of another kind. The message does not
/// name the file.
cv::Mat decodePicture(std::string_view bytes);

/// The size of a PNG or JPEG picture, from its header.
/// @throws std::runtime_error where the header is damaged or of another kind. The message does not
/// name the file.
cv::Size pictureSize(std::string_view bytes);

}  // namespace efm
