// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <opencv2/core.hpp>
#include <vector>

namespace efm {

/// Pictures from left to right, their tops in line, on white.
cv::Mat3b sideBySide(const std::vector<cv::Mat3b>& pictures);
/// Pictures from top to bottom, each in the middle, on white.
cv::Mat3b oneBelowAnother(const std::vector<cv::Mat3b>& pictures);

}  // namespace efm
