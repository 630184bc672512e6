// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <opencv2/core.hpp>
#include <string_view>

namespace efm {

/// Whether a file begins as a PFM ("portable float map", Debevec) does, of grey or of colours.
bool looksLikePfm(std::string_view bytes);

/// The image of a grey PFM: lines "Pf", "width height" and "scale", then float32 rows from the
/// bottom upwards, little endian where the scale is negative. The scale's size is not applied, as
/// in stereo benchmarks (Middlebury).
/// @throws std::runtime_error naming the line or byte, the value and what was expected.
cv::Mat1f parsePfm(std::string_view bytes);

}  // namespace efm
