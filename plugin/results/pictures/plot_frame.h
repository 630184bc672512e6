// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <opencv2/core.hpp>
#include <string>

#include "plugin/results/pictures/curve_plot.h"

namespace efm {

/// The rectangle that curves are drawn in, and the values at its edges.
struct PlotFrame {
  cv::Rect area;  ///< Pixels of the picture.
  AxisRange x;
  AxisRange y;

  /// The pixel of a point in the picture. NaN for a value that a logarithmic axis cannot show.
  cv::Point2d pixelOf(const cv::Point2d& point) const {
    return {area.x + x.fractionAlong(point.x) * (area.width - 1),
            area.br().y - 1 - y.fractionAlong(point.y) * (area.height - 1)};
  }
};

/// Computes the frame of a plot: the picture without its labels; the ends of the axes fit the
/// curves.
/// @throws std::invalid_argument naming the plot if an end of an axis does not fit.
PlotFrame layOut(const CurvePlot& plot);

/// Draws grid, axes, ticks, labels and title.
void drawAxes(cv::Mat3b& picture, const CurvePlot& plot, const PlotFrame& frame);

// What all parts of a plot share. Text is ASCII.

inline constexpr int kPlotGap = 6;  ///< Pixels between two parts.
inline constexpr double kPlotTextScale = 0.42;
inline constexpr double kPlotTitleScale = 0.5;
inline const cv::Scalar kPlotInk = cv::Scalar::all(40);    ///< Text and axes.
inline const cv::Scalar kPlotGrid = cv::Scalar::all(225);  ///< Grid lines.

/// Width and height of a text in pixels, with the parts of letters below the line.
cv::Size plotTextSize(const std::string& text, double scale = kPlotTextScale);

/// @param at the lower left corner of the text.
void writeText(cv::Mat3b& picture, const std::string& text, cv::Point at,
               double scale = kPlotTextScale);

}  // namespace efm
