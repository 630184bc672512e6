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
  std::optional<double> png_scale;  ///< Scale of 16-bit PNG files, see `readDepthFile`.
  std::filesystem::path mask;       ///< Mask of the compared pixels. Empty: all pixels.
  std::vector<double> thresholds_m = defaultDepthThresholds();  ///< For precision, recall, F1.
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
  /// Mean over the maps with points, each map with the same weight. `points` is the sum.
  DepthErrors mean;
  DepthErrors all;                     ///< Errors over all points of all maps.
  PrecisionRecall detection;           ///< Precision and recall over all pixels of all maps.
  std::uint64_t without_truth = 0;     ///< Estimated maps without truth within 1 ms.
  std::uint64_t without_estimate = 0;  ///< True maps without estimate.
};

/// Compares two files (`readDepthFile`; a folder with a depth.tiff stands for this file) or two
/// folders (`depthSeries`). Each map of a folder is paired with the true map that is nearest in
/// time, at most 1 ms away.
DepthEvaluation evaluateDepth(const std::filesystem::path& estimated,
                              const std::filesystem::path& truth,
                              const DepthEvaluationOptions& options);

/// A rectified stereo pair: the disparity of a depth Z is focal_px * baseline_m / Z pixels.
struct StereoBaseline {
  double focal_px = 0;    ///< Focal length, above 0.
  double baseline_m = 0;  ///< Distance of the cameras, above 0.
  std::string source;     ///< The file of both values, or "as given". Tables show it.
};

/// Reads the stereo pair from the report.json of the run that wrote the estimate, in `estimate` or
/// up to three folders above it. Otherwise reads it from the camchain.yaml of the truth's dataset,
/// in `truth` or up to two folders above it: camera 0's fx and its distance to camera 1.
/// @return std::nullopt if neither file has the stereo pair.
std::optional<StereoBaseline> findStereoBaseline(const std::filesystem::path& estimate,
                                                 const std::filesystem::path& truth);

/// Returns tables of at most 80 columns: if there are several maps, a line per map; a line per
/// measure, with the mean of the maps and the value of all points; precision, recall and F1 over
/// the thresholds; maps without a partner; focal length and baseline of bad-pix.
std::string evaluationTable(const DepthEvaluation& evaluation,
                            const std::optional<StereoBaseline>& stereo = std::nullopt);

/// Returns the errors as JSON. `depthEvaluationKeys` describes the keys.
std::string evaluationJson(const DepthEvaluation& evaluation,
                           const std::optional<StereoBaseline>& stereo = std::nullopt);

/// Returns the description of the JSON's keys, for the program's help.
std::string depthEvaluationKeys();

}  // namespace efm
