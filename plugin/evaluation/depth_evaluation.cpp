// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/evaluation/depth_evaluation.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <set>
#include <stdexcept>
#include <utility>

#include "mapping/depth/peak_fit.h"
#include "mapping/geometry/rig.h"
#include "mapping/geometry/timestamp.h"
#include "maps/metrics/sample_statistics.h"
#include "plugin/evaluation/depth_file.h"
#include "plugin/evaluation/evaluation_text.h"
#include "plugin/recordings/calibration/calibration_formats.h"

namespace efm {
namespace {

namespace fs = std::filesystem;

ComparedDepths readDepths(const EvaluatedMap& map, const cv::Mat1b& mask,
                          const DepthEvaluationOptions& options) {
  return {readDepthFile(map.estimate, options.png_scale),
          readDepthFile(map.truth, options.png_scale), mask};
}

cv::Mat1b maskOf(const DepthEvaluationOptions& options) {
  return options.mask.empty() ? cv::Mat1b() : readMaskFile(options.mask);
}

/// Pairs each map with the truth nearest in time.
void pairSeries(const std::vector<TimedFile>& estimates, const std::vector<TimedFile>& truths,
                DepthEvaluation& evaluation) {
  std::set<const TimedFile*> used;
  for (const TimedFile& map : estimates) {
    const TimedFile* match = nearestFile(truths, map.t_ns, kSameTimeNs);
    if (match == nullptr) {
      ++evaluation.without_truth;
      continue;
    }
    evaluation.maps.push_back({formatSeconds(map.t_ns), {}, map.file, match->file});
    used.insert(match);
  }
  evaluation.without_estimate = truths.size() - used.size();
}

/// Compares one map after the other.
/// @return true if at least one pixel has an estimated and a true depth.
bool compare(DepthEvaluation& evaluation, const cv::Mat1b& mask,
             const DepthEvaluationOptions& options) {
  std::vector<DepthPair> all;
  std::vector<DepthErrors> errors;
  for (EvaluatedMap& map : evaluation.maps) {
    const ComparedDepths depths = readDepths(map, mask, options);
    try {
      depths.validate();
    } catch (const std::invalid_argument& error) {
      throw std::runtime_error(map.estimate.string() + " and " + map.truth.string() + ": " +
                               error.what());
    }
    const std::vector<DepthPair> pairs = pairDepths(depths, options.pairing);
    const PrecisionRecall detection =
        precisionRecall(depths, options.thresholds_m, options.pairing);
    if (errors.empty()) {
      evaluation.detection = detection;
    } else {
      evaluation.detection.add(detection);
    }
    map.errors = depthErrors(pairs, options.focal_baseline);
    errors.push_back(map.errors);
    all.insert(all.end(), pairs.begin(), pairs.end());
  }
  evaluation.mean = meanOfErrors(errors);
  evaluation.all = depthErrors(all, options.focal_baseline);
  return !all.empty();
}

}  // namespace

DepthEvaluation evaluateDepth(const fs::path& estimated, const fs::path& truth,
                              const DepthEvaluationOptions& options) {
  options.pairing.validate();
  for (const fs::path& path : {estimated, truth}) {
    if (!fs::exists(path)) throw std::runtime_error("no such file: " + path.string());
  }
  // If the truth is a file, the folder of one depth map stands for the map's file.
  const bool one_map = fs::exists(estimated / "depth.tiff") && !fs::is_directory(truth);
  const fs::path estimate = one_map ? estimated / "depth.tiff" : estimated;
  const bool folders = fs::is_directory(estimate);
  if (folders && fs::exists(estimate / "depth.tiff")) {
    throw std::runtime_error(
        fmt::format("{} holds one depth map without its time: expected a file of truth beside it, "
                    "not the folder {}",
                    estimate.string(), truth.string()));
  }
  if (folders != fs::is_directory(truth)) {
    throw std::runtime_error(estimate.string() + " and " + truth.string() +
                             ": must be two files or two folders");
  }

  const cv::Mat1b mask = maskOf(options);
  DepthEvaluation evaluation;
  if (folders) {
    pairSeries(depthSeries(estimate, DepthSeriesRole::kEstimate),
               depthSeries(truth, DepthSeriesRole::kTruth), evaluation);
    if (evaluation.maps.empty()) {
      throw std::runtime_error(fmt::format("no truth in {} lies within 1 ms of a depth map of {}",
                                           truth.string(), estimate.string()));
    }
  } else {
    evaluation.maps = {{estimate.filename().string(), {}, estimate, truth}};
  }
  if (!compare(evaluation, mask, options)) {
    throw std::runtime_error(fmt::format("no pixel of {} has a depth where the truth has one{}",
                                         estimate.string(),
                                         options.mask.empty() ? "" : " and the mask is not black"));
  }
  return evaluation;
}

namespace {

/// Returns the file of that name in a folder or in one of `levels` folders above this folder.
std::optional<fs::path> fileAtOrAbove(const fs::path& path, const std::string& name, int levels) {
  fs::path folder = fs::absolute(path).lexically_normal();
  for (int level = 0; level <= levels; ++level) {
    if (fs::is_regular_file(folder / name)) return folder / name;
    folder = folder.parent_path();
  }
  return std::nullopt;
}

/// Returns std::nullopt if the file is not the report of a run.
std::optional<StereoBaseline> fromReport(const fs::path& file) {
  using Pointer = nlohmann::json::json_pointer;
  std::ifstream stream(file);
  const auto report = nlohmann::json::parse(stream, nullptr, false);
  if (!report.is_object()) return std::nullopt;
  const auto focal_px = report.value(Pointer("/reference_view/fx"), nlohmann::json());
  const auto baseline_m = report.value(Pointer("/baseline_m"), nlohmann::json());
  if (!focal_px.is_number() || !baseline_m.is_number()) return std::nullopt;
  return StereoBaseline{focal_px, baseline_m, file.string()};
}

std::optional<StereoBaseline> fromCamchain(const fs::path& file) {
  const Rig rig = readCamchain(file);
  if (rig.cameras.size() < 2) return std::nullopt;
  return StereoBaseline{rig.cameras[0].model.fx, rig.cameras[1].T_rig_cam.translation.norm(),
                        file.string()};
}

}  // namespace

std::optional<StereoBaseline> findStereoBaseline(const fs::path& estimate, const fs::path& truth) {
  const auto read = [](const fs::path& path, const char* name, int levels, auto parse) {
    const auto file = fileAtOrAbove(path, name, levels);
    auto stereo = file ? parse(*file) : std::nullopt;
    return stereo && stereo->focal_px > 0 && stereo->baseline_m > 0 ? stereo : std::nullopt;
  };
  const auto stereo = read(estimate, "report.json", 3, fromReport);
  return stereo ? stereo : read(truth, "camchain.yaml", 2, fromCamchain);
}

namespace {

/// A field of DepthErrors in the tables and in the JSON.
struct Measure {
  const char* key;
  const char* name;  ///< Name in the tables. Unit, factor and decimals are also for tables.
  const char* unit;
  std::optional<double> (*value)(const DepthErrors&);
  double factor;
  int decimals;
  bool of_each_map;  ///< Has a column in the table of the maps, which has space for six.
  const char* help;

  TableColumn column() const { return {name, key, decimals, factor}; }
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

EvaluationJson asJson(const DepthErrors& errors) {
  EvaluationJson json = {{"points", errors.points}};
  if (errors.points == 0) return json;
  for (const Measure& measure : kMeasures) {
    if (const auto value = measure.value(errors)) json[measure.key] = *value;
  }
  return json;
}

EvaluationJson asJson(const PrecisionRecall& detection) {
  EvaluationJson steps = EvaluationJson::array();
  for (std::size_t k = 0; k < detection.steps.size(); ++k) {
    steps.push_back({{"threshold_m", detection.steps[k].threshold_m},
                     {"precision", detection.precision(k)},
                     {"recall", detection.recall(k)},
                     {"f1", detection.f1(k)}});
  }
  return steps;
}

EvaluationJson asJson(const DepthEvaluation& evaluation,
                      const std::optional<StereoBaseline>& stereo) {
  EvaluationJson json;
  json["maps"] = EvaluationJson::array();
  for (const EvaluatedMap& map : evaluation.maps) {
    json["maps"].push_back(asJson(map.errors));
    json["maps"].back()["name"] = map.name;
  }
  json["mean"] = asJson(evaluation.mean);
  json["all"] = asJson(evaluation.all);
  json["curve"] = asJson(evaluation.detection);
  json["estimates"] = evaluation.detection.estimates;
  json["estimates_without_truth"] = evaluation.detection.estimates_without_truth;
  json["truths"] = evaluation.detection.truths;
  if (stereo) {
    json["focal_px"] = stereo->focal_px;
    json["baseline_m"] = stereo->baseline_m;
  }
  json["without_truth"] = evaluation.without_truth;
  json["without_estimate"] = evaluation.without_estimate;
  return json;
}

/// Returns a table with a line per map, which has the measures `of_each_map`.
std::string mapsTable(const EvaluationJson& maps) {
  std::vector<TableColumn> columns = {{"map", "name"}, {"points", "points"}};
  TableRow names = {"map", "points"};
  TableRow units = {"", ""};
  for (const Measure& measure : kMeasures) {
    if (!measure.of_each_map) continue;
    columns.push_back(measure.column());
    // "bad-pix 5px,5%" needs two lines in the heading, so every name gets two lines.
    const std::string name = std::string(measure.name) + " ";
    const std::size_t blank = name.find(' ');
    names.push_back(name.substr(0, blank));
    units.push_back(name.substr(blank + 1) + measure.unit);
  }
  std::vector<TableRow> rows = tableRows(columns, maps);
  rows[0] = units;
  rows.insert(rows.begin(), names);
  return tableText(rows);
}

/// Returns a table with a line per measure.
std::string measuresTable(const EvaluationJson& json) {
  std::vector<TableRow> rows = {{"", "mean of maps", "all points"}};
  rows.push_back({"points", "", json["all"]["points"].dump()});
  for (const Measure& measure : kMeasures) {
    const TableColumn column = measure.column();
    rows.push_back({fmt::format("{}, {}", measure.name, measure.unit), column.textIn(json["mean"]),
                    column.textIn(json["all"])});
  }
  if (json["maps"].size() < 2) {
    for (TableRow& row : rows) row.erase(row.begin() + 1);
  }
  return tableText(rows);
}

std::string detectionTable(const EvaluationJson& json) {
  const std::vector<TableColumn> columns = {{"error up to m", "threshold_m", 3},
                                            {"precision %", "precision", 2, 100},
                                            {"recall %", "recall", 2, 100},
                                            {"F1 %", "f1", 2, 100}};
  return tableText(tableRows(columns, json["curve"])) +
         fmt::format("{} estimates with a truth, {} without\n{} pixels with a truth\n",
                     json["estimates"].dump(), json["estimates_without_truth"].dump(),
                     json["truths"].dump());
}

}  // namespace

std::string evaluationTable(const DepthEvaluation& evaluation,
                            const std::optional<StereoBaseline>& stereo) {
  const EvaluationJson json = asJson(evaluation, stereo);
  std::string text;
  if (evaluation.maps.size() > 1) {
    text = mapsTable(json["maps"]) + "\n";
  } else if (!evaluation.maps.empty()) {
    text = "map " + evaluation.maps.front().name + "\n";
  }
  text += measuresTable(json) + "\n" + detectionTable(json);
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
  return jsonText(asJson(evaluation, stereo));
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

}  // namespace efm
