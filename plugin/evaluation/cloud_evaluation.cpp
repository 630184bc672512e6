// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/evaluation/cloud_evaluation.h"

#include <fmt/format.h>

#include <stdexcept>

#include "maps/io/point_cloud_file.h"
#include "plugin/evaluation/depth_file.h"
#include "plugin/evaluation/evaluation_text.h"

namespace efm {
namespace {

PointCloudContent readPoints(const std::filesystem::path& file) {
  PointCloudContent content = readPointCloud(file);
  if (content.points.empty()) {
    throw std::runtime_error(file.string() + ": no points: expected at least one");
  }
  return content;
}

EvaluationJson distanceJson(const SampleStatistics& statistics, double p90_m) {
  return {{"points", statistics.count},    {"mean_m", statistics.mean},
          {"median_m", statistics.median}, {"rms_m", statistics.rms},
          {"max_m", statistics.max},       {"p90_m", p90_m}};
}

/// Moves the map into the truth's frame.
CloudAlignment align(std::vector<CloudPoint>& map, const std::vector<CloudPoint>& truth,
                     const std::filesystem::path& map_file) {
  try {
    const CloudAlignment alignment = alignCloud(map, truth);
    for (CloudPoint& point : map) point.p_world = alignment.T_truth_map * point.p_world;
    return alignment;
  } catch (const std::exception& error) {
    throw std::runtime_error(map_file.string() + ": --align: " + error.what());
  }
}

double degreesOf(const Rigid3& transform) {
  return 180 / kPi * Eigen::AngleAxisd(transform.rotation).angle();
}

EvaluationJson alignmentJson(const CloudAlignment& alignment) {
  const Eigen::Vector3d& p = alignment.T_truth_map.translation;
  const Eigen::Matrix3d rotation = alignment.T_truth_map.rotation.toRotationMatrix();
  EvaluationJson matrix = EvaluationJson::array();
  for (int row = 0; row < 3; ++row) {
    matrix.push_back({rotation(row, 0), rotation(row, 1), rotation(row, 2), p[row]});
  }
  matrix.push_back({0, 0, 0, 1});
  return {{"translation_m", {p.x(), p.y(), p.z()}},
          {"rotation_deg", degreesOf(alignment.T_truth_map)},
          {"T_truth_map", matrix},
          {"points", alignment.points},
          {"points_used", alignment.points_used}};
}

std::string alignmentText(const CloudAlignment& alignment) {
  const Eigen::Vector3d& p = alignment.T_truth_map.translation;
  return fmt::format(
      "aligned with the truth: moved by ({:.4f}, {:.4f}, {:.4f}) m\n"
      "  and turned by {:.4f} deg about the origin, from {} of {} points compared\n\n",
      p.x(), p.y(), p.z(), degreesOf(alignment.T_truth_map), alignment.points_used,
      alignment.points);
}

EvaluationJson asJson(const CloudEvaluation& evaluation) {
  const CloudErrors& errors = evaluation.errors;
  EvaluationJson json;
  json["accuracy"] = distanceJson(errors.accuracy, errors.accuracy_p90_m);
  json["completeness_distance"] =
      distanceJson(errors.completeness_distance, errors.completeness_distance_p90_m);
  json["curve"] = EvaluationJson::array();
  for (const CloudErrors::Step& step : errors.steps) {
    json["curve"].push_back({{"distance_m", step.distance_m},
                             {"within", step.within},
                             {"outliers", step.outliers},
                             {"completeness", step.completeness},
                             {"f1", step.f1}});
  }
  json["non_finite"] = evaluation.non_finite;
  if (evaluation.alignment) json["alignment"] = alignmentJson(*evaluation.alignment);
  return json;
}

}  // namespace

CloudEvaluation evaluateCloud(const std::filesystem::path& estimated,
                              const std::filesystem::path& truth,
                              const CloudEvaluationOptions& options) {
  const std::filesystem::path map_file = fileInFolder(estimated, {"map.pcd", "points.pcd"});
  auto map = readPoints(map_file);
  const auto surfaces = readPoints(fileInFolder(truth, {"gt_cloud.ply"}));
  CloudEvaluation evaluation;
  evaluation.non_finite = map.non_finite + surfaces.non_finite;
  if (options.align) evaluation.alignment = align(map.points, surfaces.points, map_file);
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
  const EvaluationJson json = asJson(evaluation);
  EvaluationJson distances = {json["accuracy"], json["completeness_distance"]};
  distances[0]["name"] = "map to truth (accuracy)";
  distances[1]["name"] = "truth to map (completeness)";
  const std::vector<TableColumn> distance_columns = {
      {"distances in m", "name"}, {"points", "points"}, {"mean", "mean_m", 4},
      {"median", "median_m", 4},  {"90 %", "p90_m", 4}, {"rms", "rms_m", 4},
      {"max", "max_m", 4}};
  const std::vector<TableColumn> step_columns = {{"distance m", "distance_m", 3},
                                                 {"map within %", "within", 2, 100},
                                                 {"outliers %", "outliers", 2, 100},
                                                 {"completeness %", "completeness", 2, 100},
                                                 {"F1 %", "f1", 2, 100}};
  std::string text = evaluation.alignment ? alignmentText(*evaluation.alignment) : "";
  text += tableText(tableRows(distance_columns, distances)) + "\n" +
          tableText(tableRows(step_columns, json["curve"]));
  if (evaluation.non_finite > 0) {
    text += fmt::format("{} points are not finite and were left out\n", evaluation.non_finite);
  }
  return text;
}

std::string evaluationJson(const CloudEvaluation& evaluation) {
  return jsonText(asJson(evaluation));
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
         "  non_finite   points of the files that are not finite; they are left out\n"
         "  alignment    with --align: translation_m, rotation_deg (the angle), T_truth_map (the\n"
         "            4x4 matrix, rows; turns about the origin, then moves), points (of the map,\n"
         "            that were compared with the truth), points_used (of these, in the last\n"
         "            round)\n";
}

}  // namespace efm
