// SPDX-License-Identifier: BSD-3-Clause
#pragma once

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
  Rigid3 T_truth_map;           ///< Maps the map's frame to the truth's frame.
  std::size_t points = 0;       ///< Points of the map that were compared with the truth.
  std::size_t points_used = 0;  ///< Compared points that were near enough in the last round.
};

/// Finds the rigid transform that brings a map onto the true surfaces, with PCL's ICP: distances
/// along the truth's normals (Chen and Medioni, Image and Vision Computing 1992). Starts from the
/// identity. In each round it uses the points whose distance is within three times the median. A
/// large map is subsampled: every n-th point is compared, at least 20,000 points.
/// @throws std::runtime_error that names the expected input: if a cloud has too few points, if the
/// surfaces do not determine all six coordinates (a single wall), or if ICP does not converge.
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

/// Compares a map with the truth. Both are PCD or PLY files. A folder of a run stands for its
/// map.pcd or points.pcd, a folder of a dataset for its gt_cloud.ply.
CloudEvaluation evaluateCloud(const std::filesystem::path& estimated,
                              const std::filesystem::path& truth,
                              const CloudEvaluationOptions& options);

std::string evaluationTable(const CloudEvaluation& evaluation);
/// Returns the errors as JSON. `cloudEvaluationKeys` describes the keys.
std::string evaluationJson(const CloudEvaluation& evaluation);
/// Returns the description of the JSON's keys, for the program's help.
std::string cloudEvaluationKeys();

}  // namespace efm
