// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/evaluation/cloud_evaluation_plot.h"

#include <algorithm>
#include <array>
#include <vector>

#include "plugin/results/pictures/curve_plot.h"

namespace efm {
cv::Mat3b evaluationPlot(const CloudEvaluation& evaluation) {
  std::vector<CloudErrors::Step> steps = evaluation.errors.steps;
  std::sort(steps.begin(), steps.end(),
            [](const auto& a, const auto& b) { return a.distance_m < b.distance_m; });
  std::array<std::vector<cv::Point2d>, 3> points;
  for (const CloudErrors::Step& step : steps) {
    points[0].emplace_back(step.distance_m, 100 * step.within);
    points[1].emplace_back(step.distance_m, 100 * step.completeness);
    points[2].emplace_back(step.distance_m, 100 * step.f1);
  }
  CurvePlot plot;
  plot.title = "map and truth";
  plot.x = {"distance [m]", AxisScale::kLogarithmic};
  plot.y = {"within [%]", AxisScale::kLinear, 0, 102};
  plot.curves = {{"accuracy: map to truth", points[0], CurveStyle::kMarkedLine},
                 {"completeness: truth to map", points[1], CurveStyle::kMarkedLine},
                 {"F1", points[2], CurveStyle::kMarkedLine}};
  return drawCurves(plot);
}

}  // namespace efm
