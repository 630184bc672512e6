// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/evaluation_plot.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <opencv2/imgcodecs.hpp>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "mapping/timestamp.h"
#include "maps/sample_statistics.h"
#include "maps/whole_file.h"
#include "plugin/curve_plot.h"
#include "plugin/depth_file.h"
#include "plugin/picture_grid.h"
#include "plugin/text_table.h"
#include "plugin/value_picture.h"

namespace efm {
namespace {

constexpr float kNone = std::numeric_limits<float>::quiet_NaN();

/// Estimate, truth and error as images of values.
struct ShownDepths {
  cv::Mat1f estimate;
  cv::Mat1f truth;
  cv::Mat1f error;
  std::vector<double> depths_m;  ///< Of the truth, where it is seen.
  std::vector<double> errors_m;
};

ShownDepths shownDepths(const EvaluatedMap& map, const DepthEvaluationOptions& options) {
  ComparedDepths depths{readDepthFile(map.estimate, options.png_scale),
                        readDepthFile(map.truth, options.png_scale),
                        {}};
  if (!options.mask.empty()) depths.mask = readMaskFile(options.mask);
  const cv::Size size = depths.truth.size();
  ShownDepths shown{{size, kNone}, {size, kNone}, {size, kNone}, {}, {}};
  for (int y = 0; y < size.height; ++y) {
    for (int x = 0; x < size.width; ++x) {
      if (depths.hasTruth(y, x, options.pairing)) {
        shown.truth(y, x) = depths.truth(y, x);
        shown.depths_m.push_back(depths.truth(y, x));
      }
      if (!depths.hasEstimate(y, x)) continue;
      shown.estimate(y, x) = depths.estimate(y, x);
      const double truth_m = bestTruth(depths, {x, y}, options.pairing);
      if (!(truth_m > 0)) continue;
      shown.error(y, x) = static_cast<float>(std::abs(depths.estimate(y, x) - truth_m));
      shown.errors_m.push_back(shown.error(y, x));
    }
  }
  return shown;
}

const EvaluatedMap& typicalMap(const DepthEvaluation& evaluation) {
  std::vector<const EvaluatedMap*> maps;
  for (const EvaluatedMap& map : evaluation.maps) maps.push_back(&map);
  const auto middle = maps.begin() + static_cast<std::ptrdiff_t>(maps.size() / 2);
  std::nth_element(maps.begin(), middle, maps.end(),
                   [](const EvaluatedMap* a, const EvaluatedMap* b) {
                     return a->errors.points < b->errors.points;
                   });
  return **middle;
}

/// The range that all but the outermost hundredths of the values lie in.
AxisRange usualRange(const std::vector<double>& values, AxisScale scale) {
  if (values.empty()) return rangeAround({1}, scale);
  AxisRange range{quantileOf(values, 0.01), quantileOf(values, 0.99), scale};
  if (!(range.from < range.to)) range = rangeAround({range.from}, scale);
  return range;
}

cv::Mat3b depthImages(const EvaluatedMap& map, const DepthEvaluationOptions& options) {
  const ShownDepths shown = shownDepths(map, options);
  const AxisRange depths = usualRange(shown.depths_m, AxisScale::kLogarithmic);
  double largest_m = quantileOf(shown.errors_m, shown.errors_m.empty() ? 1 : 0.95);
  if (!(largest_m > 0)) largest_m = 0.01;
  const std::string title =
      "estimate " + map.name + ", " + std::to_string(map.errors.points) + " points";
  return sideBySide({drawValues({title, shown.estimate, depths, "m", true}),
                     drawValues({"truth", shown.truth, depths, "m", true}),
                     drawValues({"absolute error", shown.error, {0, largest_m}, "m"})});
}

Curve curveOf(const std::string& label, std::vector<cv::Point2d> points) {
  return {label, std::move(points), CurveStyle::kMarkedLine, std::nullopt};
}

cv::Mat3b detectionPlot(const PrecisionRecall& detection) {
  std::array<std::vector<cv::Point2d>, 3> points;
  for (std::size_t k = 0; k < detection.steps.size(); ++k) {
    const double threshold_m = detection.steps[k].threshold_m;
    points[0].emplace_back(threshold_m, 100 * detection.precision(k));
    points[1].emplace_back(threshold_m, 100 * detection.recall(k));
    points[2].emplace_back(threshold_m, 100 * detection.f1(k));
  }
  for (auto& curve : points) {
    std::sort(curve.begin(), curve.end(), [](auto& a, auto& b) { return a.x < b.x; });
  }
  CurvePlot plot;
  plot.title = "precision, recall, F1";
  plot.x = {"error threshold [m]", AxisScale::kLogarithmic, std::nullopt, std::nullopt};
  plot.y = {"share [%]", AxisScale::kLinear, 0, 102};
  plot.curves = {curveOf("precision", points[0]), curveOf("recall", points[1]),
                 curveOf("F1", points[2])};
  plot.size = {520, 380};
  return drawCurves(plot);
}

/// The errors of each map over its time in the recording.
cv::Mat3b errorsOverTime(const std::vector<EvaluatedMap>& maps) {
  const std::int64_t start_ns = parseSeconds(maps.front().name).value_or(0);
  std::vector<cv::Point2d> means;
  std::vector<cv::Point2d> medians;
  for (const EvaluatedMap& map : maps) {
    if (map.errors.points == 0) continue;
    const double t_s = secondsBetween(start_ns, parseSeconds(map.name).value_or(start_ns));
    means.emplace_back(t_s, map.errors.mean_abs_m);
    medians.emplace_back(t_s, map.errors.median_abs_m);
  }
  CurvePlot plot;
  plot.title = "absolute error of the maps";
  plot.x.label = "time since the first [s]";
  plot.y.label = "error [m]";
  plot.y.from = 0;
  plot.curves = {curveOf("mean", means), curveOf("median", medians)};
  plot.size = {520, 380};
  return drawCurves(plot);
}

/// The two axes that positions extend most along.
std::pair<int, int> widestAxes(const std::vector<PosePair>& pairs) {
  Eigen::Vector3d low = pairs.front().T_world_rig.translation;
  Eigen::Vector3d high = low;
  for (const PosePair& pair : pairs) {
    low = low.cwiseMin(pair.T_world_rig.translation);
    high = high.cwiseMax(pair.T_world_rig.translation);
  }
  int least = 2;  // z where they are alike: from above
  for (const int axis : {1, 0}) {
    if (high[axis] - low[axis] < high[least] - low[least]) least = axis;
  }
  return {least == 0 ? 1 : 0, least == 2 ? 1 : 2};
}

cv::Mat3b topView(const TrajectoryEvaluation& evaluation) {
  constexpr std::array<const char*, 3> kLabels = {"x [m]", "y [m]", "z [m]"};
  const auto [across, upwards] = widestAxes(evaluation.pairs);
  const auto place = [a = across, u = upwards](const Eigen::Vector3d& p) {
    return cv::Point2d(p[a], p[u]);
  };
  std::vector<cv::Point2d> truth;
  std::vector<cv::Point2d> estimate;
  for (const PosePair& pair : evaluation.pairs) {
    truth.push_back(place(pair.T_world_rig.translation));
    estimate.push_back(place(evaluation.T_world_map * pair.T_map_rig.translation));
  }
  CurvePlot plot;
  plot.title = "trajectories";
  plot.x.label = kLabels[static_cast<std::size_t>(across)];
  plot.y.label = kLabels[static_cast<std::size_t>(upwards)];
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
  plot.curves = {{"", points, CurveStyle::kLine, std::nullopt}};
  plot.size = {560, 256};
  return drawCurves(plot);
}

}  // namespace

cv::Mat3b evaluationPlot(const DepthEvaluation& evaluation, const DepthEvaluationOptions& options) {
  const cv::Mat3b curves = detectionPlot(evaluation.detection);
  const bool several = evaluation.maps.size() > 1;
  return oneBelowAnother(
      {depthImages(typicalMap(evaluation), options),
       several ? sideBySide({curves, errorsOverTime(evaluation.maps)}) : curves});
}

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
  plot.x = {"distance [m]", AxisScale::kLogarithmic, std::nullopt, std::nullopt};
  plot.y = {"share within [%]", AxisScale::kLinear, 0, 102};
  plot.curves = {curveOf("accuracy: map to truth", points[0]),
                 curveOf("completeness: truth to map", points[1]), curveOf("F1", points[2])};
  return drawCurves(plot);
}

cv::Mat3b evaluationPlot(const TrajectoryEvaluation& evaluation) {
  return sideBySide(
      {topView(evaluation),
       oneBelowAnother(
           {overTime(evaluation, evaluation.errors.translation_m, 1, "position [m]"),
            overTime(evaluation, evaluation.errors.rotation_rad, 180 / M_PI, "rotation [deg]")})});
}

void writePlot(const std::filesystem::path& file, const cv::Mat3b& picture) {
  if (file.extension() != ".png") {
    throw std::runtime_error(file.string() + ": expected a name that ends in .png for the plot");
  }
  writeWhole(file, [&](const std::filesystem::path& temporary) {
    if (!cv::imwrite(temporary.string(), picture)) {
      throw std::runtime_error("the file cannot be created or the disk is full");
    }
  });
}

}  // namespace efm
