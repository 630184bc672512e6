// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <opencv2/core.hpp>

#include <string>
#include <string_view>

namespace efm {

/// Returns the bytes of a PNG file: rows as they are, packed by zlib's level 1. Figures with PNG's
/// filters take four times the time and are not smaller; with level 6, a quarter smaller and three
/// times the time.
/// @param picture 8-bit, grey or BGR.
std::string encodePng(const cv::Mat& picture);

/// Returns the bytes of a float32 TIFF file, without compression.
std::string encodeTiff(const cv::Mat1f& image);

/// Returns whether the bytes begin as a PNG does.
bool looksLikePng(std::string_view bytes);
/// Returns whether the bytes begin as a TIFF does, or as a BigTIFF (for files above 4 GB).
bool looksLikeTiff(std::string_view bytes);

/// Returns the pixels of a PNG or TIFF file, at most 2^26. PNG: 8 or 16 bits, grey, BGR or BGRA; a
/// palette becomes colours. TIFF: samples of 8 or 16 bits, float32 or float64, grey, BGR or BGRA.
/// @throws std::runtime_error if the file is damaged or of another kind. The message does not name
/// the file.
cv::Mat decodePicture(std::string_view bytes);

/// Returns the size of a PNG or JPEG picture, from its header.
/// @throws std::runtime_error if the header is damaged or of another kind. The message does not
/// name the file.
cv::Size pictureSize(std::string_view bytes);

}  // namespace efm
