// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/evaluation/cloud_evaluation.h"

#include <fmt/format.h>

#include <nlohmann/json.hpp>
#include <stdexcept>

#include "maps/io/point_cloud_file.h"
#include "plugin/evaluation/file_in_folder.h"
#include "plugin/evaluation/text_table.h"

namespace efm {
namespace {

using Json = nlohmann::ordered_json;

PointCloudContent readPoints(const std::filesystem::path& file) {
  PointCloudContent content = readPointCloud(file);
  if (content.points.empty()) {
    throw std::runtime_error(file.string() + ": no points: expected at least one");
  }
  return content;
}

std::vector<std::string> distanceRow(const std::string& name, const SampleStatistics& statistics,
                                     double p90_m) {
  std::vector<std::string> row = {name, std::to_string(statistics.count)};
  for (const double value :
       {statistics.mean, statistics.median, p90_m, statistics.rms, statistics.max}) {
    row.push_back(fixedText(value, 4));
  }
  return row;
}

Json distanceJson(const SampleStatistics& statistics, double p90_m) {
  return {{"points", statistics.count},    {"mean_m", statistics.mean},
          {"median_m", statistics.median}, {"rms_m", statistics.rms},
          {"max_m", statistics.max},       {"p90_m", p90_m}};
}

}  // namespace

CloudEvaluation evaluateCloud(const std::filesystem::path& estimated,
                              const std::filesystem::path& truth,
                              const CloudEvaluationOptions& options) {
  const auto map = readPoints(fileInFolder(estimated, {"map.pcd", "points.pcd"}));
  const auto surfaces = readPoints(fileInFolder(truth, {"gt_cloud.ply"}));
  CloudEvaluation evaluation;
  evaluation.non_finite = map.non_finite + surfaces.non_finite;
  if (options.to_find.empty()) {
    evaluation.errors = cloudErrors(map.points, surfaces.points, options.distances_m);
  } else {
    const auto to_find = readPoints(options.to_find);
    evaluation.non_finite += to_find.non_finite;
    evaluation.errors =
        cloudErrors(map.points, surfaces.points, to_find.points, options.distances_m);
  }
  return evaluation;
}

std::string evaluationTable(const CloudEvaluation& evaluation) {
  const CloudErrors& errors = evaluation.errors;
  TextTable distances;
  distances.add({"distances in m", "points", "mean", "median", "90 %", "rms", "max"});
  distances.add(distanceRow("map to truth (accuracy)", errors.accuracy, errors.accuracy_p90_m));
  distances.add(distanceRow("truth to map (completeness)", errors.completeness_distance,
                            errors.completeness_distance_p90_m));
  TextTable steps;
  steps.add({"distance m", "map within %", "outliers %", "completeness %", "F1 %"});
  for (const CloudErrors::Step& step : errors.steps) {
    steps.add({fixedText(step.distance_m, 3), fixedText(100 * step.within, 2),
               fixedText(100 * step.outliers, 2), fixedText(100 * step.completeness, 2),
               fixedText(100 * step.f1, 2)});
  }
  std::string text = distances.text() + "\n" + steps.text();
  if (evaluation.non_finite > 0) {
    text += fmt::format("{} points are not finite and were left out\n", evaluation.non_finite);
  }
  return text;
}

std::string evaluationJson(const CloudEvaluation& evaluation) {
  const CloudErrors& errors = evaluation.errors;
  Json json;
  json["accuracy"] = distanceJson(errors.accuracy, errors.accuracy_p90_m);
  json["completeness_distance"] =
      distanceJson(errors.completeness_distance, errors.completeness_distance_p90_m);
  json["curve"] = Json::array();
  for (const CloudErrors::Step& step : errors.steps) {
    json["curve"].push_back({{"distance_m", step.distance_m},
                             {"within", step.within},
                             {"outliers", step.outliers},
                             {"completeness", step.completeness},
                             {"f1", step.f1}});
  }
  json["non_finite"] = evaluation.non_finite;
  return json.dump(2) + "\n";
}

std::string cloudEvaluationKeys() {
  return "Keys of --json (fractions from 0 to 1):\n"
         "  accuracy  distances from each point of the map to the nearest true point: points,\n"
         "            mean_m, median_m, rms_m, max_m, p90_m (90 % of the distances are smaller)\n"
         "  completeness_distance   the same from each true point to the nearest point of the map\n"
         "  curve     a list, one entry per distance: distance_m, within (fraction of the map's\n"
         "            points within this distance of the truth), outliers (the rest),\n"
         "            completeness (fraction of the true points within this distance of the\n"
         "            map), f1 (harmonic mean of within and completeness)\n"
         "  non_finite   points of the files that are not finite; they are left out\n";
}

}  // namespace efm
