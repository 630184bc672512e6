// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "plugin/results/pictures/curve_plot.h"
#include "test/studies/methods/method_comparison.h"

namespace efm::studies {

/// A number of a set of errors, for trends and curves.
using ErrorFigure = double (*)(const DepthErrors&);

double meanCm(const DepthErrors& errors);
double medianCm(const DepthErrors& errors);
/// 5 px and 5 %, as in the paper's scripts.
double badPercent(const DepthErrors& errors);
double thousandPoints(const DepthErrors& errors);

/// The figure of each method, at `pixels`: `&MethodResult::own`, for example.
std::vector<double> eachOf(const std::vector<MethodResult>& results,
                           DepthErrors MethodResult::*pixels, ErrorFigure figure);

/// "1.5, 2.0, 3.1"
std::string listed(const std::vector<double>& values, int decimals = 1);
/// "1.5 against 2.0"
std::string against(double value, double other, int decimals);
/// "+3.1 %": the first relative to the second.
std::string percentMore(double value, double than);

bool grows(const std::vector<double>& values);
/// @param tolerance of a step upwards.
bool falls(const std::vector<double>& values, double tolerance = 0);

double minOf(const std::vector<double>& values);
double maxOf(const std::vector<double>& values);

/// A line with a dot at every point.
Curve markedCurve(const std::string& label, const std::vector<double>& x,
                  const std::vector<double>& y);
/// Mean and median error of one camera and of two over a size.
cv::Mat3b errorCurves(const std::string& title, const PlotAxis& axis,
                      const std::vector<double>& sizes, const std::vector<MethodResult>& mono,
                      const std::vector<MethodResult>& stereo);

}  // namespace efm::studies
