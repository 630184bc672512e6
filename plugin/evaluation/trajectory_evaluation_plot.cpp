// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/evaluation/trajectory_evaluation_plot.h"

#include <array>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "mapping/geometry/rigid3.h"
#include "mapping/geometry/timestamp.h"
#include "maps/metrics/sample_statistics.h"
#include "plugin/evaluation/text_table.h"
#include "plugin/results/pictures/curve_plot.h"
#include "plugin/results/pictures/picture.h"

namespace efm {
namespace {

/// The two axes of largest extent.
std::pair<int, int> widestAxes(const std::vector<PosePair>& pairs) {
  Eigen::Vector3d low = pairs.front().T_world_rig.translation;
  Eigen::Vector3d high = low;
  for (const PosePair& pair : pairs) {
    low = low.cwiseMin(pair.T_world_rig.translation);
    high = high.cwiseMax(pair.T_world_rig.translation);
  }
  int narrowest = 2;  // z if extents are equal: the view from above
  for (const int axis : {1, 0}) {
    if (high[axis] - low[axis] < high[narrowest] - low[narrowest]) narrowest = axis;
  }
  return {narrowest == 0 ? 1 : 0, narrowest == 2 ? 1 : 2};
}

cv::Mat3b topView(const TrajectoryEvaluation& evaluation) {
  constexpr std::array<const char*, 3> kLabels = {"x [m]", "y [m]", "z [m]"};
  const auto [x_axis, y_axis] = widestAxes(evaluation.pairs);
  const auto project = [x = x_axis, y = y_axis](const Eigen::Vector3d& p) {
    return cv::Point2d(p[x], p[y]);
  };
  std::vector<cv::Point2d> truth;
  std::vector<cv::Point2d> estimate;
  for (const PosePair& pair : evaluation.pairs) {
    truth.push_back(project(pair.T_world_rig.translation));
    estimate.push_back(project(evaluation.T_world_map * pair.T_map_rig.translation));
  }
  CurvePlot plot;
  plot.title = "trajectories";
  plot.x.label = kLabels[static_cast<std::size_t>(x_axis)];
  plot.y.label = kLabels[static_cast<std::size_t>(y_axis)];
  plot.curves = {{"truth", truth, CurveStyle::kLine, curveColour(6)},
                 {"estimate, aligned", estimate, CurveStyle::kLine, curveColour(1)}};
  plot.equal_units = true;
  plot.size = {560, 520};
  return drawCurves(plot);
}

cv::Mat3b overTime(const TrajectoryEvaluation& evaluation, const std::vector<double>& errors,
                   double factor, const std::string& label) {
  std::vector<cv::Point2d> points;
  for (std::size_t i = 0; i < errors.size(); ++i) {
    points.emplace_back(secondsBetween(evaluation.pairs.front().t_ns, evaluation.pairs[i].t_ns),
                        factor * errors[i]);
  }
  const double rmse = factor * statisticsOf(errors).rms;
  CurvePlot plot;
  plot.title = "absolute error of " + label + ", RMSE " + fixedText(rmse, 4);
  plot.x.label = "time since the first pose [s]";
  plot.y.label = label;
  plot.y.from = 0;
  if (!(rmse > 0)) plot.y.to = 1;
  plot.curves = {{"", points}};
  plot.size = {560, 256};
  return drawCurves(plot);
}

}  // namespace

cv::Mat3b evaluationPlot(const TrajectoryEvaluation& evaluation) {
  return sideBySide(
      {topView(evaluation),
       oneBelowAnother(
           {overTime(evaluation, evaluation.errors.translation_m, 1, "position [m]"),
            overTime(evaluation, evaluation.errors.rotation_rad, 180 / kPi, "rotation [deg]")})});
}

}  // namespace efm
