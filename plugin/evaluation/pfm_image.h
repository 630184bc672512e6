// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <opencv2/core.hpp>
#include <string_view>

namespace efm {

/// Whether these are the first bytes of a PFM ("portable float map", Debevec), grey or coloured.
bool looksLikePfm(std::string_view bytes);

/// The image of a grey PFM: lines "Pf", "width height" and "scale", then float32 rows from the
/// bottom upwards, little endian if the scale is negative. As in stereo benchmarks (Middlebury),
/// the size of the scale has no effect. (OpenCV's reader divides by it and refuses CRLF line ends.)
/// @throws std::runtime_error naming the line or byte, the value and the expected one.
cv::Mat1f parsePfm(std::string_view bytes);

}  // namespace efm
