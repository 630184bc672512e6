// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <opencv2/core.hpp>
#include <vector>

namespace efm {

/// Joins pictures from left to right on white, with their tops in line.
cv::Mat3b sideBySide(const std::vector<cv::Mat3b>& pictures);
/// Joins pictures from top to bottom on white, each centred.
cv::Mat3b oneBelowAnother(const std::vector<cv::Mat3b>& pictures);

}  // namespace efm
