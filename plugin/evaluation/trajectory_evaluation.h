// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "mapping/base/named_choice.h"
#include "maps/metrics/trajectory_metrics.h"

namespace efm {

/// Names of the alignments on the command line and in the JSON.
inline constexpr NamedChoice<TrajectoryAlignment> kTrajectoryAlignments[] = {
    {TrajectoryAlignment::kSe3, "se3"},
    {TrajectoryAlignment::kOrigin, "origin"},
    {TrajectoryAlignment::kNone, "none"}};

struct TrajectoryEvaluationOptions {
  /// Maximum time between the two poses of a pair, from 0. Default: 0.01 s, as in evo.
  double max_difference_s = 0.01;
  TrajectoryAlignment alignment = TrajectoryAlignment::kSe3;
  /// Spacings of the relative errors. Empty: one frame, one second, and 10 to 50 % of the true
  /// length, as in rpg_trajectory_evaluation.
  std::vector<RelativeSpacing> spacings;
  /// Units of times without one in the file of the estimate and of the truth: s, ms, us or ns.
  /// Empty: found.
  std::string estimate_time_unit{};
  std::string truth_time_unit{};
};

/// The relative errors over one spacing. The count is 0 if no pair of poses has this spacing.
struct EvaluatedSpacing {
  RelativeSpacing spacing;
  SampleStatistics translation_m;
  SampleStatistics rotation_rad;
};

struct TrajectoryEvaluation {
  std::filesystem::path estimate_file;
  std::filesystem::path truth_file;
  std::uint64_t estimate_poses = 0;  ///< Number of poses in the file.
  std::uint64_t truth_poses = 0;
  double max_difference_s = 0;  ///< Copied from the options.
  std::vector<PosePair> pairs;  ///< Pairs of poses in the order of time.
  TrajectoryAlignment alignment = TrajectoryAlignment::kSe3;
  Rigid3 T_world_map;        ///< Aligns the estimate with the truth.
  PoseErrors errors;         ///< Absolute errors, one per pair.
  double true_length_m = 0;  ///< Length of the true path through the pairs.
  std::vector<EvaluatedSpacing> relative;
};

/// Compares a trajectory with the truth. Both are files that `readPoses` reads. A folder of a run
/// stands for its trajectory.txt, a folder of a dataset for its poses.txt or groundtruth.txt.
TrajectoryEvaluation evaluateTrajectory(const std::filesystem::path& estimated,
                                        const std::filesystem::path& truth,
                                        const TrajectoryEvaluationOptions& options);

/// Returns text that names the compared files, pairs, times and the alignment, and then the errors.
/// Lines have at most 80 columns; long file names may exceed them.
std::string evaluationTable(const TrajectoryEvaluation& evaluation);
/// Returns the errors as JSON. `trajectoryEvaluationKeys` describes the keys.
std::string evaluationJson(const TrajectoryEvaluation& evaluation);
/// Returns the description of the JSON's keys, for the program's help.
std::string trajectoryEvaluationKeys();

}  // namespace efm
