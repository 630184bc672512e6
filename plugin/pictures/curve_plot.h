// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <opencv2/core.hpp>
#include <optional>
#include <string>
#include <vector>

#include "plugin/pictures/plot_axis.h"

namespace efm {

/// Curves over a common axis, drawn by OpenCV alone: no plotting program is needed to look at a
/// result. Text is ASCII, as OpenCV's fonts are.

enum class CurveStyle {
  kLine,
  kMarkedLine,  ///< A line with a dot at every point.
  kDots,
};

struct Curve {
  std::string label;                ///< In the legend; empty: not there.
  std::vector<cv::Point2d> points;  ///< In the order they are joined; a NaN interrupts the line.
  CurveStyle style = CurveStyle::kLine;
  /// BGR; by default the palette's colour of the curve's number, see `curveColour`.
  std::optional<cv::Vec3b> colour;
};

struct PlotAxis {
  std::string label;  ///< What it shows, with its unit.
  AxisScale scale = AxisScale::kLinear;
  /// The ends; by default what the curves need. What lies beyond them is cut off.
  std::optional<double> from;
  std::optional<double> to;
};

struct CurvePlot {
  std::string title;
  PlotAxis x;
  PlotAxis y;
  std::vector<Curve> curves;
  /// A unit is as long upwards as it is sideways, for the view of a place. Linear axes only; the
  /// ends are widened where that needs it.
  bool equal_units = false;
  cv::Size size = {640, 480};  ///< Pixels, at least 240x180.
};

/// A white picture with title, axes, ticks, grid, curves, and a legend at the side or in the corner
/// where it hides least.
/// @throws std::invalid_argument naming the plot where an end of an axis does not fit its scale or
/// the other end, or the picture is too small.
cv::Mat3b drawCurves(const CurvePlot& plot);

/// BGR of curve 0, 1, …; told apart by those who do not see red from green (Okabe and Ito 2008);
/// repeats after seven.
cv::Vec3b curveColour(std::size_t number);

}  // namespace efm
