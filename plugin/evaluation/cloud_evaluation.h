// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <opencv2/core.hpp>

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "maps/metrics/cloud_metrics.h"
#include "plugin/evaluation/cloud_alignment.h"

namespace efm {

struct CloudEvaluationOptions {
  std::vector<double> distances_m = defaultCloudDistances();  ///< Each above 0.
  /// The true points for completeness, for example a dataset's gt_edges.ply. Empty: all points.
  std::filesystem::path to_find;
  bool align = false;  ///< Aligns the map with the truth before errors are taken (`alignCloud`).
};

struct CloudEvaluation {
  CloudErrors errors;
  std::uint64_t non_finite = 0;  ///< Points of the files that are not finite. They are left out.
  std::optional<CloudAlignment> alignment;
};

/// Compares a map with the truth: PCD or PLY files, or a run's folder (its map.pcd or points.pcd)
/// and a dataset's (its gt_cloud.ply).
CloudEvaluation evaluateCloud(const std::filesystem::path& estimated,
                              const std::filesystem::path& truth,
                              const CloudEvaluationOptions& options);

std::string evaluationTable(const CloudEvaluation& evaluation);
/// `cloudEvaluationKeys` describes the keys.
std::string evaluationJson(const CloudEvaluation& evaluation);
/// The keys of the JSON, for the program's help.
std::string cloudEvaluationKeys();

/// Accuracy, completeness and F1 over the distance.
cv::Mat3b evaluationPlot(const CloudEvaluation& evaluation);

}  // namespace efm
