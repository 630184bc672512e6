// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <limits>
#include <opencv2/core.hpp>
#include <optional>
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

/// Pairs the two maps (metres; 0, negative or not finite: none) wherever both have a depth, in the
/// order of the image's rows.
/// @throws std::invalid_argument where the maps differ in size or the options are not valid.
std::vector<DepthPair> pairDepths(const cv::Mat1f& estimate, const cv::Mat1f& truth,
                                  const DepthPairingOptions& options = {});

/// Errors over a set of pixels. All are 0 where there is no point.
struct DepthErrors {
  std::uint64_t points = 0;
  double mean_abs_m = 0;    ///< Mean |Z - Z_true| (Ghosh and Gallego 2022, Table II).
  double median_abs_m = 0;  ///< Median |Z - Z_true| (ibid.).
  /// Median |1/Z - 1/Z_true|, in 1/m: what a plane step of inverse spacing is measured in.
  double median_inverse = 0;
  /// Share with a disparity error over 5 px and over 5 % of the true disparity, as the scripts that
  /// accompany the paper count it. Needs focal length times baseline.
  std::optional<double> bad_pix_5px;
  /// Share with a disparity error over 3 px and over 5 % (Geiger et al., CVPR 2012; KITTI 2015).
  std::optional<double> bad_pix_3px;
};

/// @param focal_baseline focal length in pixels times baseline in metres, which turns depth into
/// disparity; above 0. Medians of an even number of points are the mean of the two in the middle.
DepthErrors depthErrors(const std::vector<DepthPair>& pairs,
                        std::optional<double> focal_baseline = std::nullopt);

}  // namespace efm
