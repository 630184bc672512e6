// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/evaluation/depth_evaluation_plot.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "mapping/depth/peak_fit.h"
#include "mapping/geometry/timestamp.h"
#include "maps/metrics/sample_statistics.h"
#include "plugin/evaluation/depth_file.h"
#include "plugin/results/pictures/curve_plot.h"
#include "plugin/results/pictures/depth_picture.h"
#include "plugin/results/pictures/picture.h"

namespace efm {
namespace {

constexpr float kNone = std::numeric_limits<float>::quiet_NaN();

/// Estimate, truth and error as images of values.
struct ShownDepths {
  cv::Mat1f estimate;
  cv::Mat1f truth;
  cv::Mat1f error;
  std::vector<double> depths_m;  ///< Of the truth.
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
  const auto fewer = [](const EvaluatedMap* a, const EvaluatedMap* b) {
    return a->errors.points < b->errors.points;
  };
  return *upperMedian(maps, fewer);
}

/// The range from the 1st to the 99th percentile.
AxisRange usualRange(const std::vector<double>& values, AxisScale scale) {
  if (values.empty()) return rangeAround({1}, scale);
  AxisRange range{quantileOf(values, 0.01), quantileOf(values, 0.99), scale};
  if (!(range.from < range.to)) range = rangeAround({range.from}, scale);
  return range;
}

cv::Mat3b depthImages(const EvaluatedMap& map, const DepthEvaluationOptions& options) {
  const ShownDepths shown = shownDepths(map, options);
  const AxisRange depths = usualRange(shown.depths_m, AxisScale::kLogarithmic);
  double max_error_m = quantileOf(shown.errors_m, shown.errors_m.empty() ? 1 : 0.95);
  if (!(max_error_m > 0)) max_error_m = 0.01;
  const std::string title = fmt::format("estimate {}, {} points", map.name, map.errors.points);
  return sideBySide({drawValues({title, shown.estimate, depths, "m", Palette::kBrightToDark}),
                     drawValues({"truth", shown.truth, depths, "m", Palette::kBrightToDark}),
                     drawValues({"absolute error", shown.error, {0, max_error_m}, "m"})});
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
  plot.x = {"error threshold [m]", AxisScale::kLogarithmic};
  plot.y = {"fraction [%]", AxisScale::kLinear, 0, 102};
  plot.curves = {{"precision", points[0], CurveStyle::kMarkedLine},
                 {"recall", points[1], CurveStyle::kMarkedLine},
                 {"F1", points[2], CurveStyle::kMarkedLine}};
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
  plot.curves = {{"mean", means, CurveStyle::kMarkedLine},
                 {"median", medians, CurveStyle::kMarkedLine}};
  plot.size = {520, 380};
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

}  // namespace efm
