// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cmath>
#include <limits>
#include <opencv2/core.hpp>
#include <vector>

namespace efm {

/// The estimate and the truth of a pixel, z-depths in metres.
struct DepthPair {
  double estimate_m = 0;
  double truth_m = 0;
};

struct DepthPairingOptions {
  /// The truth of a pixel is the one nearest in inverse depth within this number of columns and
  /// rows. 1 tolerates silhouettes, where an edge pixel may fall on the far background. Range: 0 to
  /// 100.
  int tolerance_px = 0;
  /// Farther truths are ignored. Above 0.
  double max_depth_m = std::numeric_limits<double>::infinity();

  /// @throws std::invalid_argument naming the field, its value and the allowed range.
  void validate() const;
};

/// Whether a pixel of a depth map (metres) has a depth: finite and above 0.
inline bool isDepth(float depth_m) { return std::isfinite(depth_m) && depth_m > 0; }

/// A depth map and its truth, of the same size, metres.
struct ComparedDepths {
  cv::Mat1f estimate;
  cv::Mat1f truth;
  cv::Mat1b mask;  ///< Pixels that are evaluated: not 0. Empty: all.

  bool counts(int y, int x) const { return mask.empty() || mask(y, x) != 0; }
  bool hasEstimate(int y, int x) const { return counts(y, x) && isDepth(estimate(y, x)); }
  bool hasTruth(int y, int x, const DepthPairingOptions& options) const {
    return counts(y, x) && isDepth(truth(y, x)) && truth(y, x) <= options.max_depth_m;
  }
  /// @throws std::invalid_argument where the maps or the mask differ in size.
  void validate() const;
};

/// The truth that the estimate at a pixel is compared with, metres; 0 where there is none within
/// the tolerance.
double bestTruth(const ComparedDepths& depths, cv::Point pixel, const DepthPairingOptions& options);

/// The pairs of all pixels where both maps have a depth, row by row.
/// @throws std::invalid_argument where the maps differ in size or the options are not valid.
std::vector<DepthPair> pairDepths(const ComparedDepths& depths,
                                  const DepthPairingOptions& options = {});
std::vector<DepthPair> pairDepths(const cv::Mat1f& estimate, const cv::Mat1f& truth,
                                  const DepthPairingOptions& options = {});

}  // namespace efm
