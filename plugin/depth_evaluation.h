// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "maps/depth_metrics.h"

namespace efm {

struct DepthEvaluationOptions {
  DepthPairingOptions pairing;
  /// Focal length in pixels times baseline in metres, which bad-pix needs.
  std::optional<double> focal_baseline;
};

/// The errors of one depth map.
struct EvaluatedMap {
  std::string name;  ///< Time in seconds, or the file.
  DepthErrors errors;
};

/// The errors of depth maps against their truth.
struct DepthEvaluation {
  std::vector<EvaluatedMap> maps;
  /// Mean over the maps that have points, each counting the same; `points` is their sum.
  DepthErrors mean;
  DepthErrors all;                  ///< Over all points of all maps.
  std::uint64_t without_truth = 0;  ///< Estimated maps that no truth lies within 1 ms of.
};

/// Compares two float32 TIFF files (metres, 0: none; a folder with a depth.tiff stands for it), or
/// two folders: a map's output or its
/// keyframes/ with a dataset folder or its depth/ (index.txt: `t file` a line). Maps are paired
/// with the truth nearest in time, within 1 ms.
/// @throws std::runtime_error naming the file or folder that cannot be read, is not what it must
/// be, or where nothing can be compared.
DepthEvaluation evaluateDepth(const std::filesystem::path& estimated,
                              const std::filesystem::path& truth,
                              const DepthEvaluationOptions& options);

/// One line per map, then the mean of the maps and all points.
std::string evaluationTable(const DepthEvaluation& evaluation);
std::string evaluationJson(const DepthEvaluation& evaluation);

}  // namespace efm
