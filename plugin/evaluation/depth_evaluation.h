// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "maps/metrics/depth_metrics.h"
#include "maps/metrics/precision_recall.h"

namespace efm {

struct DepthEvaluationOptions {
  DepthPairingOptions pairing;
  /// Focal length in pixels times baseline in metres, which bad-pix needs.
  std::optional<double> focal_baseline;
  std::optional<double> png_scale;  ///< Of 16-bit PNG, as `readDepthFile` has it.
  std::filesystem::path mask;       ///< Its pixels alone count; empty: all.
  std::vector<double> thresholds_m = defaultDepthThresholds();  ///< Of precision, recall and F1.
};

/// The errors of one depth map.
struct EvaluatedMap {
  std::string name;  ///< Time in seconds, or the file.
  DepthErrors errors;
  std::filesystem::path estimate;
  std::filesystem::path truth;
};

/// The errors of depth maps against their truth.
struct DepthEvaluation {
  std::vector<EvaluatedMap> maps;
  /// Mean over the maps that have points, each counting the same; `points` is their sum.
  DepthErrors mean;
  DepthErrors all;                     ///< Over all points of all maps.
  PrecisionRecall detection;           ///< Over all pixels of all maps.
  std::uint64_t without_truth = 0;     ///< Estimated maps that no truth lies within 1 ms of.
  std::uint64_t without_estimate = 0;  ///< True maps that no estimate was held against.
};

/// Compares two files (`readDepthFile`; a folder with a depth.tiff stands for it), or two folders
/// (`depthSeries`), whose maps are paired with the truth nearest in time, within 1 ms.
/// @throws std::runtime_error naming the file or folder that cannot be read, is not what it must
/// be, or where nothing can be compared; std::invalid_argument where the options are not valid.
DepthEvaluation evaluateDepth(const std::filesystem::path& estimated,
                              const std::filesystem::path& truth,
                              const DepthEvaluationOptions& options);

}  // namespace efm
