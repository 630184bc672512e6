// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/evaluation/cloud_evaluation.h"

#include <initializer_list>
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

std::vector<std::string> rowOf(const std::string& name, const SampleStatistics& statistics,
                               const std::string& ninety) {
  return {name,
          std::to_string(statistics.count),
          fixedText(statistics.mean, 4),
          fixedText(statistics.median, 4),
          ninety,
          fixedText(statistics.rms, 4),
          fixedText(statistics.max, 4)};
}

Json asJson(const SampleStatistics& statistics) {
  return {{"points", statistics.count},
          {"mean_m", statistics.mean},
          {"median_m", statistics.median},
          {"rms_m", statistics.rms},
          {"max_m", statistics.max}};
}

}  // namespace

CloudEvaluation evaluateCloud(const std::filesystem::path& estimated,
                              const std::filesystem::path& truth,
                              const CloudEvaluationOptions& options) {
  const auto map = readPoints(fileInFolder(estimated, {"map.pcd", "points.pcd"}));
  const auto surfaces = readPoints(fileInFolder(truth, {"gt_cloud.ply"}));
  CloudEvaluation evaluation;
  evaluation.without_place = map.non_finite + surfaces.non_finite;
  if (options.to_find.empty()) {
    evaluation.errors = cloudErrors(map.points, surfaces.points, options.distances_m);
  } else {
    const auto to_find = readPoints(options.to_find);
    evaluation.without_place += to_find.non_finite;
    evaluation.errors =
        cloudErrors(map.points, surfaces.points, to_find.points, options.distances_m);
  }
  return evaluation;
}

std::string evaluationTable(const CloudEvaluation& evaluation) {
  const CloudErrors& errors = evaluation.errors;
  TextTable distances;
  distances.add({"distances in m", "points", "mean", "median", "90 %", "rms", "max"});
  distances.add(
      rowOf("map to truth (accuracy)", errors.accuracy, fixedText(errors.accuracy_p90_m, 4)));
  distances.add(rowOf("truth to map (gaps)", errors.completeness_distance,
                      fixedText(errors.completeness_distance_p90_m, 4)));
  TextTable steps;
  steps.add({"distance m", "map within %", "outliers %", "completeness %", "F1 %"});
  for (const CloudErrors::Step& step : errors.steps) {
    steps.add({fixedText(step.distance_m, 3), fixedText(100 * step.within, 2),
               fixedText(100 * step.outliers, 2), fixedText(100 * step.completeness, 2),
               fixedText(100 * step.f1, 2)});
  }
  std::string text = distances.text() + "\n" + steps.text();
  if (evaluation.without_place > 0) {
    text += std::to_string(evaluation.without_place) + " points are not finite and were left out\n";
  }
  return text;
}

std::string evaluationJson(const CloudEvaluation& evaluation) {
  const CloudErrors& errors = evaluation.errors;
  Json json;
  json["accuracy"] = asJson(errors.accuracy);
  json["accuracy"]["share_90_m"] = errors.accuracy_p90_m;
  json["gaps"] = asJson(errors.completeness_distance);
  json["gaps"]["share_90_m"] = errors.completeness_distance_p90_m;
  json["curve"] = Json::array();
  for (const CloudErrors::Step& step : errors.steps) {
    json["curve"].push_back({{"distance_m", step.distance_m},
                             {"within", step.within},
                             {"outliers", step.outliers},
                             {"completeness", step.completeness},
                             {"f1", step.f1}});
  }
  json["without_place"] = evaluation.without_place;
  return json.dump(2) + "\n";
}

std::string cloudEvaluationKeys() {
  return "Keys of --json (shares from 0 to 1):\n"
         "  accuracy  distances from the map's points to the nearest of the truth, metres: "
         "points,\n"
         "            mean_m, median_m, rms_m, max_m, share_90_m (90 % of the points lie within)\n"
         "  gaps      the same from the true points to the nearest of the map\n"
         "  curve     a list, of each distance: distance_m, within (share of the map's points at\n"
         "            most so far from the truth), outliers (the rest), completeness (share of "
         "the\n"
         "            true points at most so far from the map), f1 (harmonic mean of within and\n"
         "            completeness)\n"
         "  without_place   points of the files that are not finite: left out\n";
}

}  // namespace efm
