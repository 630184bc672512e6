// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <opencv2/core.hpp>

#include <optional>
#include <string>
#include <vector>

namespace efm {

enum class AxisScale {
  kLinear,
  kLogarithmic,  ///< Shows values above 0 only.
  kInverse,      ///< Linear in 1 / value: for depth. Shows values above 0 only.
};

/// The interval of an axis. `rangeAround` ensures that both ends are finite, that from < to, and
/// that both are above 0 on a logarithmic or inverse axis.
struct AxisRange {
  double from = 0;
  double to = 1;
  AxisScale scale = AxisScale::kLinear;

  /// The position of a value on the axis: 0 at `from`, 1 at `to`. NaN if the axis cannot show
  /// the value.
  double fractionAlong(double value) const;
};

/// The range of all values that an axis of this scale can show, with a margin of 4 % of its length
/// at both ends (of its logarithm unless it is linear). Without a value: a range around 0, or
/// around 1. With one value: a range around it.
AxisRange rangeAround(const std::vector<double>& values, AxisScale scale);

/// A mark on an axis.
struct AxisTick {
  double value = 0;
  std::string text;
};

/// Round values inside the range. On a linear axis their spacing is 1, 2 or 5 times a power of ten.
/// On a logarithmic axis they are the powers of ten; if these are few, also 2 and 5 times them; if
/// even these are fewer than three, the ticks of a linear axis. On an inverse axis the roundest
/// values that have space.
/// @param max_ticks at least 2. A logarithmic axis may have one or two more.
std::vector<AxisTick> ticksOf(const AxisRange& range, int max_ticks);

enum class CurveStyle {
  kLine,
  kMarkedLine,  ///< A line with a dot at every point.
  kDots,
};

struct Curve {
  std::string label;                ///< In the legend. Empty: not in the legend.
  std::vector<cv::Point2d> points;  ///< In the order of the line. NaN interrupts the line.
  CurveStyle style = CurveStyle::kLine;
  std::optional<cv::Vec3b> colour = std::nullopt;  ///< BGR. Default: `curveColour` of its index.
};

struct PlotAxis {
  std::string label;  ///< Quantity and unit.
  AxisScale scale = AxisScale::kLinear;
  /// The ends. Default: the ends of the curves. Curves are cut at the ends.
  std::optional<double> from = std::nullopt;
  std::optional<double> to = std::nullopt;
};

/// Curves over common axes, drawn by OpenCV. Text is ASCII, as OpenCV's fonts are.
struct CurvePlot {
  std::string title;
  PlotAxis x;
  PlotAxis y;
  std::vector<Curve> curves;
  /// A unit has the same length on both axes: a square is drawn as a square. The ends of an axis
  /// are widened for it. Linear axes only.
  bool equal_units = false;
  cv::Size size = {640, 480};  ///< Pixels, at least 240x180.
};

/// Draws title, axes, ticks, grid, curves and legend on white. The legend stands where it hides the
/// smallest part of the curves.
cv::Mat3b drawCurves(const CurvePlot& plot);

/// Colour (BGR) of curve 0, 1, …: seven colours that colour-blind readers can distinguish (Okabe
/// and Ito 2008), then the same again.
cv::Vec3b curveColour(std::size_t index);

// What all parts of a picture share. Text is ASCII.

inline constexpr double kPlotTextScale = 0.42;
inline const cv::Scalar kPlotInk = cv::Scalar::all(40);  ///< Text and axes.

/// Width and height of a text in pixels, with the parts of letters below the line.
cv::Size plotTextSize(const std::string& text, double scale = kPlotTextScale);

/// @param at the lower left corner of the text.
void writeText(cv::Mat3b& picture, const std::string& text, cv::Point at,
               double scale = kPlotTextScale);

/// A position for OpenCV's functions with `kSubpixelBits` as shift.
inline constexpr int kSubpixelBits = 4;
inline cv::Point subpixel(const cv::Point2d& pixel) {
  constexpr double kOnes = 1 << kSubpixelBits;
  return {cvRound(pixel.x * kOnes), cvRound(pixel.y * kOnes)};
}

}  // namespace efm
