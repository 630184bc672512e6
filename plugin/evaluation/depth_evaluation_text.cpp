// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "mapping/depth/peak_fit.h"
#include "mapping/geometry/timestamp.h"
#include "maps/metrics/sample_statistics.h"
#include "plugin/evaluation/depth_evaluation.h"
#include "plugin/evaluation/depth_file.h"
#include "plugin/evaluation/text_table.h"
#include "plugin/results/pictures/curve_plot.h"
#include "plugin/results/pictures/depth_picture.h"
#include "plugin/results/pictures/picture.h"

namespace efm {
namespace {

using Json = nlohmann::ordered_json;

/// A field of DepthErrors in the tables and in the JSON.
struct Measure {
  const char* key;
  const char* name;  ///< In the tables, as the unit, factor and decimals.
  const char* unit;
  std::optional<double> (*value)(const DepthErrors&);
  double factor;
  int decimals;
  bool of_each_map;  ///< Has a column in the table of the maps, which has space for six.
  const char* help;
};

using E = DepthErrors;
using V = std::optional<double>;

constexpr std::array<Measure, 13> kMeasures = {{
    {"mean_abs_m", "mean |dZ|", "m", [](const E& e) { return V(e.mean_abs_m); }, 1, 4, true,
     "mean |Z - Z_true|, metres"},
    {"median_abs_m", "median |dZ|", "m", [](const E& e) { return V(e.median_abs_m); }, 1, 4, true,
     "median |Z - Z_true|, metres"},
    {"median_inverse", "median |d(1/Z)|", "1/m", [](const E& e) { return V(e.median_inverse); }, 1,
     5, false, "median |1/Z - 1/Z_true|, 1/m"},
    {"bad_pix_5px", "bad-pix 5px,5%", "%", [](const E& e) { return e.bad_pix_5px; }, 100, 2, true,
     "fraction with a disparity error over 5 px and 5 %"},
    {"bad_pix_3px", "bad-pix 3px,5%", "%", [](const E& e) { return e.bad_pix_3px; }, 100, 2, false,
     "fraction with a disparity error over 3 px and 5 % (KITTI)"},
    {"silog", "SILog", "x100", [](const E& e) { return V(e.silog); }, 1, 3, false,
     "100 (mean d^2 - (mean d)^2), d = ln Z - ln Z_true"},
    {"aerrr", "AErrR", "%", [](const E& e) { return V(e.aerrr); }, 100, 2, true,
     "mean |Z - Z_true| / Z_true"},
    {"aerrr_by_estimate", "AErrR by estimate", "%",
     [](const E& e) { return V(e.aerrr_by_estimate); }, 100, 2, false, "mean |Z - Z_true| / Z"},
    {"log_rmse", "log RMSE", "x100", [](const E& e) { return V(e.log_rmse); }, 1, 3, false,
     "100 sqrt(mean d^2)"},
    {"delta_1", "delta<1.25", "%", [](const E& e) { return V(e.delta[0]); }, 100, 2, true,
     "fraction with max(Z/Z_true, Z_true/Z) under 1.25"},
    {"delta_2", "delta<1.25^2", "%", [](const E& e) { return V(e.delta[1]); }, 100, 2, false,
     "the same under 1.25^2"},
    {"delta_3", "delta<1.25^3", "%", [](const E& e) { return V(e.delta[2]); }, 100, 2, false,
     "the same under 1.25^3"},
    {"beyond_tenth", "beyond 10%", "%", [](const E& e) { return V(e.beyond_tenth); }, 100, 2, false,
     "fraction with |Z - Z_true| over a tenth of Z_true"},
}};

std::string valueText(const Measure& measure, const DepthErrors& errors) {
  const auto value = measure.value(errors);
  const bool there = errors.points > 0 && value;
  return there ? fixedText(measure.factor * *value, measure.decimals) : "-";
}

/// A line per map, with the measures `of_each_map`.
std::string mapsTable(const std::vector<EvaluatedMap>& maps) {
  TextTable table;
  std::vector<std::string> names = {"map", "points"};
  std::vector<std::string> units = {"", ""};
  for (const Measure& measure : kMeasures) {
    if (!measure.of_each_map) continue;
    // "bad-pix 5px,5%" takes two lines of the heading, and so do all.
    const std::string_view name = measure.name;
    const std::size_t blank = std::min(name.find(' '), name.size());
    names.emplace_back(name.substr(0, blank));
    units.push_back(
        fmt::format("{} {}", name.substr(std::min(blank + 1, name.size())), measure.unit));
  }
  table.add(names);
  table.add(units);
  for (const EvaluatedMap& map : maps) {
    std::vector<std::string> row = {map.name, std::to_string(map.errors.points)};
    for (const Measure& measure : kMeasures) {
      if (measure.of_each_map) row.push_back(valueText(measure, map.errors));
    }
    table.add(row);
  }
  return table.text();
}

/// A line per measure.
std::string measuresTable(const DepthEvaluation& evaluation) {
  const bool several = evaluation.maps.size() > 1;
  TextTable table;
  const auto add = [&](const std::string& name, const std::string& mean, const std::string& all) {
    table.add(several ? std::vector{name, mean, all} : std::vector{name, all});
  };
  add("", "mean of maps", "all points");
  add("points", "", std::to_string(evaluation.all.points));
  for (const Measure& measure : kMeasures) {
    add(fmt::format("{}, {}", measure.name, measure.unit), valueText(measure, evaluation.mean),
        valueText(measure, evaluation.all));
  }
  return table.text();
}

Json asJson(const DepthErrors& errors) {
  Json json = {{"points", errors.points}};
  if (errors.points == 0) return json;
  for (const Measure& measure : kMeasures) {
    if (const auto value = measure.value(errors)) json[measure.key] = *value;
  }
  return json;
}

std::string detectionTable(const PrecisionRecall& detection) {
  TextTable table;
  table.add({"error up to m", "precision %", "recall %", "F1 %"});
  for (std::size_t k = 0; k < detection.steps.size(); ++k) {
    table.add({fixedText(detection.steps[k].threshold_m, 3),
               fixedText(100 * detection.precision(k), 2), fixedText(100 * detection.recall(k), 2),
               fixedText(100 * detection.f1(k), 2)});
  }
  return table.text() +
         fmt::format("{} estimates with a truth, {} without\n{} pixels with a truth\n",
                     detection.estimates, detection.estimates_without_truth, detection.truths);
}

}  // namespace

std::string evaluationTable(const DepthEvaluation& evaluation,
                            const std::optional<StereoBaseline>& stereo) {
  std::string text;
  if (evaluation.maps.size() > 1) {
    text = mapsTable(evaluation.maps) + "\n";
  } else if (!evaluation.maps.empty()) {
    text = "map " + evaluation.maps.front().name + "\n";
  }
  text += measuresTable(evaluation) + "\n" + detectionTable(evaluation.detection);
  if (stereo) {
    text += fmt::format("bad-pix with focal length {:.2f} px and baseline {:.4f} m\n({})\n",
                        stereo->focal_px, stereo->baseline_m, stereo->source);
  } else if (!evaluation.all.bad_pix_5px) {
    text += "no bad-pix: it needs a focal length and a baseline (--focal, --baseline)\n";
  }
  if (evaluation.without_truth > 0) {
    text += fmt::format("{} depth maps have no truth within 1 ms\n", evaluation.without_truth);
  }
  if (evaluation.without_estimate > 0) {
    text += fmt::format("{} true maps have no estimate\n", evaluation.without_estimate);
  }
  return text;
}

std::string evaluationJson(const DepthEvaluation& evaluation,
                           const std::optional<StereoBaseline>& stereo) {
  Json json;
  json["maps"] = Json::array();
  for (const EvaluatedMap& map : evaluation.maps) {
    Json one = asJson(map.errors);
    one["name"] = map.name;
    json["maps"].push_back(one);
  }
  json["mean"] = asJson(evaluation.mean);
  json["all"] = asJson(evaluation.all);
  const PrecisionRecall& detection = evaluation.detection;
  json["curve"] = Json::array();
  for (std::size_t k = 0; k < detection.steps.size(); ++k) {
    json["curve"].push_back({{"threshold_m", detection.steps[k].threshold_m},
                             {"precision", detection.precision(k)},
                             {"recall", detection.recall(k)},
                             {"f1", detection.f1(k)}});
  }
  json["estimates"] = detection.estimates;
  json["estimates_without_truth"] = detection.estimates_without_truth;
  json["truths"] = detection.truths;
  if (stereo) {
    json["focal_px"] = stereo->focal_px;
    json["baseline_m"] = stereo->baseline_m;
  }
  json["without_truth"] = evaluation.without_truth;
  json["without_estimate"] = evaluation.without_estimate;
  return json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

std::string depthEvaluationKeys() {
  std::string text =
      "Keys of --json (fractions from 0 to 1):\n"
      "  maps      a list, one entry per map: name, points and\n";
  for (const Measure& measure : kMeasures) {
    text += fmt::format("            {:18}{}\n", measure.key, measure.help);
  }
  return text +
         "            (left out if points is 0; bad_pix_... only with focal length and baseline)\n"
         "  mean      mean over the maps; points is the sum\n"
         "  all       over all points of all maps\n"
         "  curve     a list, one entry per threshold: threshold_m, precision, recall, f1; over\n"
         "            all maps\n"
         "  estimates, estimates_without_truth, truths   numbers of pixels: precision is a\n"
         "            fraction of estimates, recall a fraction of truths\n"
         "  focal_px, baseline_m              of bad-pix\n"
         "  without_truth, without_estimate   maps without a partner in time\n";
}

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
