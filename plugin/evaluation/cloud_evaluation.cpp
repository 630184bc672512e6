// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/evaluation/cloud_evaluation.h"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <array>
#include <stdexcept>

#include "maps/io/point_cloud_file.h"
#include "plugin/evaluation/depth_series.h"
#include "plugin/evaluation/text_table.h"
#include "plugin/results/pictures/curve_plot.h"

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

Json alignmentJson(const CloudAlignment& alignment) {
  const Eigen::Vector3d& p = alignment.T_truth_map.translation;
  const Eigen::Matrix3d rotation = alignment.T_truth_map.rotation.toRotationMatrix();
  Json matrix = Json::array();
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
  std::string text = evaluation.alignment ? alignmentText(*evaluation.alignment) : "";
  text += distances.text() + "\n" + steps.text();
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
  if (evaluation.alignment) json["alignment"] = alignmentJson(*evaluation.alignment);
  return json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
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
