// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <opencv2/core.hpp>
#include <string_view>

namespace efm {

/// The maximum width and height of a PFM or NumPy image. More means a damaged header.
inline constexpr std::uint64_t kMaxImageSide = 65535;

/// The image of a NumPy array (`parseNpyHeader`): two dimensions, [row][column], float32 or
/// float64 of either byte order, in C order. Doubles are rounded to float.
/// @throws std::runtime_error naming the wrong part of the header, its value and the expected one.
cv::Mat1f parseNpy(std::string_view bytes);

}  // namespace efm
