// SPDX-License-Identifier: BSD-3-Clause
#include "test/studies/methods/error_figures.h"

#include <algorithm>

#include "test/studies/report/study_section.h"

namespace efm::studies {

double meanCm(const DepthErrors& errors) { return 100 * errors.mean_abs_m; }
double medianCm(const DepthErrors& errors) { return 100 * errors.median_abs_m; }
double badPercent(const DepthErrors& errors) { return 100 * errors.bad_pix_5px.value_or(0); }
double thousandPoints(const DepthErrors& errors) {
  return 1e-3 * static_cast<double>(errors.points);
}

std::vector<double> eachOf(const std::vector<MethodResult>& results,
                           DepthErrors MethodResult::*pixels, ErrorFigure figure) {
  std::vector<double> values;
  for (const MethodResult& result : results) values.push_back(figure(result.*pixels));
  return values;
}

std::string listed(const std::vector<double>& values, int decimals) {
  std::string text;
  for (const double value : values) {
    text += (text.empty() ? "" : ", ") + formatNumber(value, decimals);
  }
  return text;
}

std::string percentMore(double value, double than) {
  const double percent = 100 * (value / than - 1);
  return (percent < 0 ? "" : "+") + formatNumber(percent, 1) + " %";
}

bool grows(const std::vector<double>& values) {
  return std::is_sorted(values.begin(), values.end());
}

bool falls(const std::vector<double>& values, double tolerance) {
  for (std::size_t i = 1; i < values.size(); ++i) {
    if (values[i] > values[i - 1] + tolerance) return false;
  }
  return true;
}

double minOf(const std::vector<double>& values) {
  return *std::min_element(values.begin(), values.end());
}
double maxOf(const std::vector<double>& values) {
  return *std::max_element(values.begin(), values.end());
}

std::string against(double value, double other, int decimals) {
  return formatNumber(value, decimals) + " against " + formatNumber(other, decimals);
}

Curve markedCurve(const std::string& label, const std::vector<double>& x,
                  const std::vector<double>& y) {
  Curve curve{label, {}, CurveStyle::kMarkedLine, {}};
  for (std::size_t i = 0; i < x.size(); ++i) curve.points.emplace_back(x[i], y[i]);
  return curve;
}

cv::Mat3b errorCurves(const std::string& title, const PlotAxis& axis,
                      const std::vector<double>& sizes, const std::vector<MethodResult>& mono,
                      const std::vector<MethodResult>& stereo) {
  const auto own = &MethodResult::own;
  CurvePlot plot;
  plot.title = title;
  plot.x = axis;
  plot.y = {"error [cm], own pixels", AxisScale::kLinear, 0, {}};
  plot.curves = {markedCurve("one camera, mean", sizes, eachOf(mono, own, meanCm)),
                 markedCurve("one camera, median", sizes, eachOf(mono, own, medianCm)),
                 markedCurve("two cameras, mean", sizes, eachOf(stereo, own, meanCm)),
                 markedCurve("two cameras, median", sizes, eachOf(stereo, own, medianCm))};
  return drawCurves(plot);
}

}  // namespace efm::studies
