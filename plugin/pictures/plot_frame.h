// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <opencv2/core.hpp>

#include "plugin/pictures/curve_plot.h"

namespace efm {

/// The rectangle that curves are drawn in, and where values lie in it.
struct PlotFrame {
  cv::Rect area;  ///< Pixels of the picture.
  AxisRange x;
  AxisRange y;

  /// Where a point lies, in pixels of the picture; NaN where it has no place on an axis.
  cv::Point2d place(const cv::Point2d& point) const {
    return {area.x + x.shareAlong(point.x) * (area.width - 1),
            area.br().y - 1 - y.shareAlong(point.y) * (area.height - 1)};
  }
};

/// The frame of a plot: what its labels leave, with ends of the axes that suit the curves.
/// @throws std::invalid_argument naming the plot where an end of an axis does not fit.
PlotFrame layOut(const CurvePlot& plot);

/// Grid, axes, ticks, labels and title.
void drawAxes(cv::Mat3b& picture, const CurvePlot& plot, const PlotFrame& frame);

}  // namespace efm
