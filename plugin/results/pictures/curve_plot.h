// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <opencv2/core.hpp>
#include <optional>
#include <string>
#include <vector>

#include "plugin/results/pictures/plot_axis.h"

namespace efm {

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
/// @throws std::invalid_argument naming the plot if an end of an axis does not fit its scale or the
/// other end, or if the picture is too small.
cv::Mat3b drawCurves(const CurvePlot& plot);

/// Colour (BGR) of curve 0, 1, …: seven colours that colour-blind readers can distinguish (Okabe
/// and Ito 2008), then the same again.
cv::Vec3b curveColour(std::size_t index);

}  // namespace efm
