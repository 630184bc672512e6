// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <opencv2/core.hpp>
#include <string>

namespace efm {

/// Small letters in pictures, ASCII.

inline constexpr double kPlotTextScale = 0.42;
inline constexpr double kPlotTitleScale = 0.5;

/// The colour of letters and axes.
cv::Scalar plotInk();

/// Width, and height with what goes below the line, in pixels.
cv::Size plotTextSize(const std::string& text, double scale = kPlotTextScale);

/// @param at the lower left corner of the letters.
void writeText(cv::Mat3b& picture, const std::string& text, cv::Point at,
               double scale = kPlotTextScale);

/// Letters turned to the left, around a point.
void writeTextUpwards(cv::Mat3b& picture, const std::string& text, cv::Point centre);

}  // namespace efm
