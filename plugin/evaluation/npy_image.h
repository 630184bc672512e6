// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <opencv2/core.hpp>
#include <string_view>

namespace efm {

/// Whether a file begins as a NumPy array (.npy) does.
bool looksLikeNpy(std::string_view bytes);

/// The image of a NumPy array (NEP 1; format 1.0 to 3.0): two dimensions, [row][column], float32 or
/// float64 of either byte order, in C order. Doubles are rounded to float.
/// @throws std::runtime_error naming what is wrong, the value and what was expected.
cv::Mat1f parseNpy(std::string_view bytes);

}  // namespace efm
