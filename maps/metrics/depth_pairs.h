// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cmath>
#include <limits>
#include <opencv2/core.hpp>
#include <vector>

namespace efm {

/// One pixel where an estimate and a truth stand side by side, z-depths in metres.
struct DepthPair {
  double estimate_m = 0;
  double truth_m = 0;
};

struct DepthPairingOptions {
  /// The truth of a pixel is the best within so many columns and rows: the one nearest in inverse
  /// depth. 1 forgives silhouettes, where an edge may fall on the far background. Range: 0 to 100.
  int tolerance_px = 0;
  /// Truth farther than this counts as none. Above 0.
  double max_depth_m = std::numeric_limits<double>::infinity();

  /// @throws std::invalid_argument naming the field, its value and the allowed range.
  void validate() const;
};

/// Whether a pixel of a depth map (metres) has a value: 0, negative, infinite and NaN are none.
inline bool isDepth(float depth_m) { return std::isfinite(depth_m) && depth_m > 0; }

/// A depth map and its truth, of the same size; metres.
struct ComparedDepths {
  cv::Mat1f estimate;
  cv::Mat1f truth;
  cv::Mat1b mask;  ///< Pixels of both maps that count: not 0. Empty: all.

  bool counts(int y, int x) const { return mask.empty() || mask(y, x) != 0; }
  bool hasEstimate(int y, int x) const { return counts(y, x) && isDepth(estimate(y, x)); }
  bool hasTruth(int y, int x, const DepthPairingOptions& options) const {
    return counts(y, x) && isDepth(truth(y, x)) && truth(y, x) <= options.max_depth_m;
  }
  /// @throws std::invalid_argument where the maps or the mask differ in size.
  void validate() const;
};

/// The truth that an estimate at a pixel is held against, in metres; 0 where there is none within
/// the tolerance.
double bestTruth(const ComparedDepths& depths, cv::Point pixel, const DepthPairingOptions& options);

/// The pairs of all pixels where both maps have a depth, in the order of the image's rows.
/// @throws std::invalid_argument where the maps differ in size or the options are not valid.
std::vector<DepthPair> pairDepths(const ComparedDepths& depths,
                                  const DepthPairingOptions& options = {});
std::vector<DepthPair> pairDepths(const cv::Mat1f& estimate, const cv::Mat1f& truth,
                                  const DepthPairingOptions& options = {});

}  // namespace efm
