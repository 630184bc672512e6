// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <opencv2/core.hpp>

#include <string>
#include <vector>

namespace efm {

enum class AxisScale {
  kLinear,
  kInverse,  ///< Linear in 1 / value, for depth. Shows only values above 0.
};

/// The interval of an axis: from < to, and both above 0 on an inverse axis.
struct AxisRange {
  double from = 0;
  double to = 1;
  AxisScale scale = AxisScale::kLinear;

  /// Returns the position of a value on the axis: 0 at `from`, 1 at `to`, NaN if the axis cannot
  /// show the value.
  double fractionAlong(double value) const;
};

/// A mark on an axis.
struct AxisTick {
  double value = 0;
  std::string text;
};

/// Returns round values inside the range. On a linear axis the spacing of ticks is 1, 2 or 5 times
/// a power of ten. On an inverse axis ticks are at the roundest values that have space.
/// @param max_ticks at least 2.
std::vector<AxisTick> ticksOf(const AxisRange& range, int max_ticks);

// Style of text and axes in all pictures. Text is ASCII.

inline constexpr double kPlotTextScale = 0.42;
inline const cv::Scalar kPlotInk = cv::Scalar::all(40);  ///< Colour of text and axes.

/// Returns width and height of a text in pixels, including the parts of letters below the line.
cv::Size plotTextSize(const std::string& text, double scale = kPlotTextScale);

/// Writes a text. @param at the lower left corner of the text.
void writeText(cv::Mat3b& picture, const std::string& text, cv::Point at,
               double scale = kPlotTextScale);

/// Shift of the positions that `subpixel` makes for OpenCV's functions.
inline constexpr int kSubpixelBits = 4;
inline cv::Point subpixel(const cv::Point2d& pixel) {
  constexpr double kOnes = 1 << kSubpixelBits;
  return {cvRound(pixel.x * kOnes), cvRound(pixel.y * kOnes)};
}

}  // namespace efm
