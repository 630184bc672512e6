// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "maps/metrics/depth_metrics.h"

namespace efm {

struct DepthEvaluationOptions {
  DepthPairingOptions pairing;
  /// Focal length in pixels times baseline in metres, for bad-pix.
  std::optional<double> focal_baseline;
  std::optional<double> png_scale;  ///< Of 16-bit PNG, see `readDepthFile`.
  std::filesystem::path mask;       ///< Only its pixels count. Empty: all pixels.
  std::vector<double> thresholds_m = defaultDepthThresholds();  ///< Of precision, recall and F1.
};

/// The errors of one depth map.
struct EvaluatedMap {
  std::string name;  ///< Time in seconds, or the file name.
  DepthErrors errors;
  std::filesystem::path estimate;
  std::filesystem::path truth;
};

/// The errors of depth maps against their truth.
struct DepthEvaluation {
  std::vector<EvaluatedMap> maps;
  /// Mean over the maps with points, each map with the same weight. `points` is their sum.
  DepthErrors mean;
  DepthErrors all;                     ///< Over all points of all maps.
  PrecisionRecall detection;           ///< Over all pixels of all maps.
  std::uint64_t without_truth = 0;     ///< Estimated maps without truth within 1 ms.
  std::uint64_t without_estimate = 0;  ///< True maps without estimate.
};

/// Compares two files (`readDepthFile`; a folder with a depth.tiff counts as this file) or two
/// folders (`depthSeries`). Each map of a folder is paired with the truth nearest in time, within
/// 1 ms.
/// @throws std::runtime_error naming the file or folder if it cannot be read, has the wrong kind,
/// or if nothing can be compared; std::invalid_argument if the options are not valid.
DepthEvaluation evaluateDepth(const std::filesystem::path& estimated,
                              const std::filesystem::path& truth,
                              const DepthEvaluationOptions& options);

}  // namespace efm
