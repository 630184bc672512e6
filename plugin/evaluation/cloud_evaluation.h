// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "maps/metrics/cloud_metrics.h"

namespace efm {

struct CloudEvaluationOptions {
  std::vector<double> distances_m = defaultCloudDistances();  ///< Each above 0.
  /// What of the truth completeness asks for, such as a dataset's gt_edges.ply; empty: all of it.
  std::filesystem::path to_find;
};

struct CloudEvaluation {
  CloudErrors errors;
  std::uint64_t without_place = 0;  ///< Points of the files that are not finite: left out.
};

/// Holds a map against the truth: PCD or PLY files, or a run's folder (its map.pcd or points.pcd)
/// and a dataset's (its gt_cloud.ply).
/// @throws std::runtime_error naming a file that cannot be read or holds no point;
/// std::invalid_argument where a distance is not above 0.
CloudEvaluation evaluateCloud(const std::filesystem::path& estimated,
                              const std::filesystem::path& truth,
                              const CloudEvaluationOptions& options);

/// For people.
std::string evaluationTable(const CloudEvaluation& evaluation);
/// For programs; its keys are in `cloudEvaluationKeys`.
std::string evaluationJson(const CloudEvaluation& evaluation);
/// What the keys of the JSON mean, for the program's help.
std::string cloudEvaluationKeys();

}  // namespace efm
