// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/evaluation/trajectory_evaluation.h"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <stdexcept>
#include <utility>

#include "mapping/geometry/rigid3.h"
#include "mapping/geometry/timestamp.h"
#include "mapping/geometry/trajectory.h"
#include "maps/metrics/sample_statistics.h"
#include "plugin/evaluation/depth_file.h"
#include "plugin/evaluation/evaluation_text.h"
#include "plugin/recordings/open/recording_formats.h"

namespace efm {
namespace {

using Unit = RelativeSpacing::Unit;

constexpr double kDegrees = 180 / kPi;

constexpr NamedChoice<Unit> kSpacingUnits[] = {
    {Unit::kFrames, "frames"}, {Unit::kMetres, "m"}, {Unit::kSeconds, "s"}};

/// Returns one frame as in evo, one second as in Sturm et al. 2012, and fractions of the length as
/// in rpg_trajectory_evaluation.
std::vector<RelativeSpacing> usualSpacings(double true_length_m) {
  std::vector<RelativeSpacing> spacings = {{Unit::kFrames, 1}, {Unit::kSeconds, 1}};
  if (!(true_length_m > 0)) return spacings;
  for (const double fraction : {0.1, 0.2, 0.3, 0.4, 0.5}) {
    spacings.push_back({Unit::kMetres, fraction * true_length_m});
  }
  return spacings;
}

EvaluationJson asJson(const SampleStatistics& statistics, double factor) {
  return {{"rmse", factor * statistics.rms},      {"mean", factor * statistics.mean},
          {"median", factor * statistics.median}, {"std", factor * statistics.stddev},
          {"min", factor * statistics.min},       {"max", factor * statistics.max}};
}

EvaluationJson asJson(const EvaluatedSpacing& relative) {
  EvaluationJson json = {{"delta", relative.spacing.amount},
                         {"unit", nameIn(kSpacingUnits, relative.spacing.unit)},
                         {"pairs", relative.translation_m.count}};
  if (relative.translation_m.count == 0) return json;
  json["translation_m"] = asJson(relative.translation_m, 1);
  json["rotation_deg"] = asJson(relative.rotation_rad, kDegrees);
  if (relative.spacing.unit == Unit::kMetres) {
    json["translation_percent"] = 100 * relative.translation_m.mean / relative.spacing.amount;
    json["rotation_deg_per_m"] = kDegrees * relative.rotation_rad.mean / relative.spacing.amount;
  }
  return json;
}

double durationOf(const TrajectoryEvaluation& evaluation) {
  return secondsBetween(evaluation.pairs.front().t_ns, evaluation.pairs.back().t_ns);
}

EvaluationJson asJson(const TrajectoryEvaluation& evaluation) {
  const Rigid3& T_world_map = evaluation.T_world_map;
  const Eigen::Quaterniond& q = T_world_map.rotation;
  const Eigen::Vector3d& p = T_world_map.translation;
  EvaluationJson json;
  json["estimate_file"] = evaluation.estimate_file.string();
  json["truth_file"] = evaluation.truth_file.string();
  json["pairs"] = evaluation.pairs.size();
  json["estimate_poses"] = evaluation.estimate_poses;
  json["truth_poses"] = evaluation.truth_poses;
  json["length_m"] = evaluation.true_length_m;
  json["duration_s"] = durationOf(evaluation);
  json["first_s"] = formatSeconds(evaluation.pairs.front().t_ns);
  json["last_s"] = formatSeconds(evaluation.pairs.back().t_ns);
  json["alignment"] = nameIn(kTrajectoryAlignments, evaluation.alignment);
  json["aligned_by"] = {{"translation_m", {p.x(), p.y(), p.z()}},
                        {"quaternion_xyzw", {q.x(), q.y(), q.z(), q.w()}}};
  json["ate"] = {{"translation_m", asJson(statisticsOf(evaluation.errors.translation_m), 1)},
                 {"rotation_deg", asJson(statisticsOf(evaluation.errors.rotation_rad), kDegrees)}};
  json["rpe"] = EvaluationJson::array();
  for (const EvaluatedSpacing& relative : evaluation.relative) {
    json["rpe"].push_back(asJson(relative));
  }
  return json;
}

/// Describes the alignment and the transform that it found.
std::string alignmentText(const TrajectoryEvaluation& evaluation) {
  const std::string name =
      "alignment  " + std::string(nameIn(kTrajectoryAlignments, evaluation.alignment)) + ": ";
  if (evaluation.alignment == TrajectoryAlignment::kNone) return name + "the poses as they are\n";
  const Rigid3& T_world_map = evaluation.T_world_map;
  const Eigen::Vector3d& p = T_world_map.translation;
  return name +
         (evaluation.alignment == TrajectoryAlignment::kSe3
              ? "least squares over all positions, without scale\n"
              : "the first poses coincide\n") +
         fmt::format("           moved by ({:.3f}, {:.3f}, {:.3f}) m, turned by {:.3f} deg\n",
                     p.x(), p.y(), p.z(),
                     kDegrees * Eigen::AngleAxisd(T_world_map.rotation).angle());
}

std::string comparedText(const TrajectoryEvaluation& evaluation) {
  return fmt::format(
             "estimate   {}\n"
             "truth      {}\n"
             "pairs      {} of {} estimated and {} true poses, at most {:.6g} s apart\n"
             "time       {} s to {} s: {:.3f} s\n"
             "true path  {:.3f} m through the pairs\n",
             evaluation.estimate_file.string(), evaluation.truth_file.string(),
             evaluation.pairs.size(), evaluation.estimate_poses, evaluation.truth_poses,
             evaluation.max_difference_s, formatSeconds(evaluation.pairs.front().t_ns),
             formatSeconds(evaluation.pairs.back().t_ns), durationOf(evaluation),
             evaluation.true_length_m) +
         alignmentText(evaluation);
}

}  // namespace

TrajectoryEvaluation evaluateTrajectory(const std::filesystem::path& estimated,
                                        const std::filesystem::path& truth,
                                        const TrajectoryEvaluationOptions& options) {
  const auto estimate_file =
      fileInFolder(estimated, {"trajectory.txt", "poses.txt", "groundtruth.txt"});
  const auto truth_file = fileInFolder(truth, {"poses.txt", "groundtruth.txt"});
  ReaderOptions reader;
  reader.pose_time_unit = options.estimate_time_unit;
  const std::vector<StampedPose> estimate = readPoses(estimate_file, reader);
  reader.pose_time_unit = options.truth_time_unit;
  reader.pose_unit_option = "--truth-time-unit";
  const std::vector<StampedPose> true_poses = readPoses(truth_file, reader);

  TrajectoryEvaluation evaluation;
  evaluation.estimate_file = estimate_file;
  evaluation.truth_file = truth_file;
  evaluation.max_difference_s = options.max_difference_s;
  evaluation.estimate_poses = estimate.size();
  evaluation.truth_poses = true_poses.size();
  evaluation.pairs = associatePoses(estimate, true_poses, options.max_difference_s);
  if (evaluation.pairs.empty()) {
    throw std::runtime_error(
        fmt::format("no pose of {} lies within {:.6f} s of one of {} (--max-diff)",
                    estimate_file.string(), options.max_difference_s, truth_file.string()));
  }
  evaluation.alignment = options.alignment;
  try {
    evaluation.T_world_map = alignTrajectories(evaluation.pairs, evaluation.alignment);
  } catch (const std::invalid_argument& error) {
    throw std::runtime_error(
        fmt::format("{}: cannot be aligned: {} (--align origin or none needs less)",
                    estimate_file.string(), error.what()));
  }
  evaluation.errors = absoluteErrors(evaluation.pairs, evaluation.T_world_map);
  evaluation.true_length_m = trueLength(evaluation.pairs);
  const auto spacings =
      options.spacings.empty() ? usualSpacings(evaluation.true_length_m) : options.spacings;
  for (const RelativeSpacing& spacing : spacings) {
    const PoseErrors errors = relativeErrors(evaluation.pairs, spacing);
    evaluation.relative.push_back(
        {spacing, statisticsOf(errors.translation_m), statisticsOf(errors.rotation_rad)});
  }
  return evaluation;
}

std::string evaluationTable(const TrajectoryEvaluation& evaluation) {
  const EvaluationJson json = asJson(evaluation);
  std::string text = comparedText(evaluation);
  for (const auto& [title, key] :
       {std::pair{"position, m", "translation_m"}, {"rotation, deg", "rotation_deg"}}) {
    std::vector<TableColumn> columns = {{title, "name"}, {"pairs", "pairs"}};
    for (const char* measure : {"rmse", "mean", "median", "std", "min", "max"}) {
      columns.push_back({measure, measure, 4});
    }
    EvaluationJson rows = {json["ate"][key]};
    rows[0].update({{"name", "absolute"}, {"pairs", json["pairs"]}});
    for (const EvaluationJson& relative : json["rpe"]) {
      const std::string unit = relative["unit"];
      rows.push_back(relative.value(key, EvaluationJson::object()));
      rows.back()["name"] =
          fmt::format("over {:.{}f} {}", double(relative["delta"]), unit == "frames" ? 0 : 3, unit);
      rows.back()["pairs"] = relative["pairs"];
    }
    text += "\n" + tableText(tableRows(columns, rows));
  }
  return text;
}

std::string evaluationJson(const TrajectoryEvaluation& evaluation) {
  return jsonText(asJson(evaluation));
}

std::string trajectoryEvaluationKeys() {
  return "Keys of --json (statistics: rmse, mean, median, std, min, max):\n"
         "  estimate_file, truth_file            the two files that are compared\n"
         "  pairs, estimate_poses, truth_poses   numbers of pairs and of poses in both files\n"
         "  length_m, duration_s                 of the true path through the pairs\n"
         "  first_s, last_s                      times of the first and the last pair, as text\n"
         "                                       with nine decimals\n"
         "  alignment, aligned_by                the kind of alignment, and its transform from\n"
         "                                       the estimate to the truth: translation_m,\n"
         "                                       quaternion_xyzw\n"
         "  ate   absolute errors: translation_m, rotation_deg, statistics of each\n"
         "  rpe   relative errors, a list: delta, unit (frames, s or m), pairs; if there are\n"
         "        pairs, translation_m and rotation_deg, statistics of each; over metres also\n"
         "        translation_percent and rotation_deg_per_m (mean errors over the length)\n";
}

}  // namespace efm
