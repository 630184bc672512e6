// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "maps/metrics/trajectory_metrics.h"

namespace efm {

struct TrajectoryEvaluationOptions {
  /// Poses further apart in time are no pair: 0.01 s as evo has it. From 0.
  double max_difference_s = 0.01;
  TrajectoryAlignment alignment = TrajectoryAlignment::kSe3;
  /// Of the relative errors; empty: one frame, a second, and 10 to 50 % of the true length, as
  /// rpg_trajectory_evaluation has them.
  std::vector<RelativeSpacing> spacings;
};

/// The relative errors over one spacing. No pair of poses may be so far apart.
struct EvaluatedSpacing {
  RelativeSpacing spacing;
  SampleStatistics translation_m;
  SampleStatistics rotation_rad;
};

struct TrajectoryEvaluation {
  std::uint64_t estimate_poses = 0;  ///< In the files.
  std::uint64_t truth_poses = 0;
  std::vector<PosePair> pairs;
  TrajectoryAlignment alignment = TrajectoryAlignment::kSe3;
  Rigid3 T_world_map;        ///< Lays the estimate over the truth.
  PoseErrors errors;         ///< Absolute, of each pair.
  double true_length_m = 0;  ///< Of the path through the pairs.
  std::vector<EvaluatedSpacing> relative;
};

/// Holds a trajectory against the truth: TUM files, or the folder of a run (its trajectory.txt) or
/// of a dataset (its poses.txt or groundtruth.txt).
/// @throws std::runtime_error naming the file that cannot be read, and where no poses pair up or
/// they cannot be aligned; std::invalid_argument where the options are not valid.
TrajectoryEvaluation evaluateTrajectory(const std::filesystem::path& estimated,
                                        const std::filesystem::path& truth,
                                        const TrajectoryEvaluationOptions& options);

/// For people.
std::string evaluationTable(const TrajectoryEvaluation& evaluation);
/// For programs; its keys are in `trajectoryEvaluationKeys`.
std::string evaluationJson(const TrajectoryEvaluation& evaluation);
/// What the keys of the JSON mean, for the program's help.
std::string trajectoryEvaluationKeys();

}  // namespace efm
