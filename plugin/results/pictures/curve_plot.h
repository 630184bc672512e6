// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <opencv2/core.hpp>

#include <optional>
#include <string>
#include <vector>

namespace efm {

enum class AxisScale {
  kLinear,
  kLogarithmic,  ///< Shows only values above 0.
  kInverse,      ///< Linear in 1 / value, for depth. Shows only values above 0.
};

/// The interval of an axis. `rangeAround` ensures that both ends are finite, that from < to, and
/// that both ends are above 0 on a logarithmic or inverse axis.
struct AxisRange {
  double from = 0;
  double to = 1;
  AxisScale scale = AxisScale::kLinear;

  /// Returns the position of a value on the axis: 0 at `from`, 1 at `to`, NaN if the axis cannot
  /// show the value.
  double fractionAlong(double value) const;
};

/// Returns the range of all values that an axis of this scale can show, with a margin of 4 % of its
/// length at both ends (measured in logarithms unless the axis is linear). If there is no value,
/// the range is around 0, or around 1. If there is one value, the range is around this value.
AxisRange rangeAround(const std::vector<double>& values, AxisScale scale);

/// A mark on an axis.
struct AxisTick {
  double value = 0;
  std::string text;
};

/// Returns round values inside the range. On a linear axis the spacing of ticks is 1, 2 or 5 times
/// a power of ten. On a logarithmic axis ticks are at the powers of ten; if there are few, also at
/// 2 and 5 times the powers; if there are still fewer than three, as on a linear axis. On an
/// inverse axis ticks are at the roundest values that have space.
/// @param max_ticks at least 2. A logarithmic axis may have one or two ticks more.
std::vector<AxisTick> ticksOf(const AxisRange& range, int max_ticks);

enum class CurveStyle {
  kLine,
  kMarkedLine,  ///< A line with a dot at every point.
  kDots,
};

struct Curve {
  std::string label;                ///< Text in the legend. Empty: not in the legend.
  std::vector<cv::Point2d> points;  ///< Points in the order of the line. NaN interrupts the line.
  CurveStyle style = CurveStyle::kLine;
  std::optional<cv::Vec3b> colour = std::nullopt;  ///< BGR. Default: `curveColour` of its index.
};

struct PlotAxis {
  std::string label;  ///< Quantity and unit.
  AxisScale scale = AxisScale::kLinear;
  /// The ends of the axis. Default: the ends of the curves. Curves are cut at the ends.
  std::optional<double> from = std::nullopt;
  std::optional<double> to = std::nullopt;
};

/// Curves over common axes, drawn by OpenCV. Text is ASCII, as OpenCV's fonts are.
struct CurvePlot {
  std::string title;
  PlotAxis x;
  PlotAxis y;
  std::vector<Curve> curves;
  /// True: a unit has the same length on both axes, so a square is drawn as a square. One axis is
  /// made longer for this. Linear axes only.
  bool equal_units = false;
  cv::Size size = {640, 480};  ///< Pixels, at least 240x180.
};

/// Draws title, axes, ticks, grid, curves and legend on white. The legend is at the place where
/// it hides the smallest part of the curves.
cv::Mat3b drawCurves(const CurvePlot& plot);

/// Returns the colour (BGR) of curve 0, 1, …: seven colours that colour-blind readers can
/// distinguish (Okabe and Ito 2008), then the same colours again.
cv::Vec3b curveColour(std::size_t index);

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
