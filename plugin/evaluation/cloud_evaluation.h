// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <opencv2/core.hpp>

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "mapping/geometry/rigid3.h"
#include "maps/cloud/cloud_points.h"
#include "maps/metrics/cloud_metrics.h"

namespace efm {

/// A map aligned with the truth.
struct CloudAlignment {
  Rigid3 T_truth_map;           ///< From the map's frame to the truth's.
  std::size_t points = 0;       ///< Of the map that were compared with the truth.
  std::size_t points_used = 0;  ///< Of these, the ones near enough in the last round.
};

/// Finds the rigid transform that brings a map onto the true surfaces, with PCL's ICP: distances
/// along the truth's normals (Chen and Medioni, Image and Vision Computing 1992). Starts from the
/// identity. In each round it uses the points whose distance is within three times the median. Of a
/// large map, every n-th point is compared, 20,000 at least.
/// @throws std::runtime_error saying what was expected: where a cloud has too few points, where the
/// surfaces do not determine all six coordinates (a single wall), or where ICP does not converge.
CloudAlignment alignCloud(const std::vector<CloudPoint>& map, const std::vector<CloudPoint>& truth);

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
