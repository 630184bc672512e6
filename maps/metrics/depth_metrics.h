// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <opencv2/core.hpp>

#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>
#include <vector>

#include "mapping/base/option.h"

namespace efm {

/// The estimate and the truth of a pixel, z-depths in metres.
struct DepthPair {
  double estimate_m = 0;
  double truth_m = 0;
};

struct DepthPairingOptions {
  /// The truth of a pixel is the true depth nearest in inverse depth within this number of columns
  /// and rows. 1 tolerates silhouettes, where an edge pixel may fall on the far background. Range:
  /// 0 to 100.
  int tolerance_px = 0;
  /// Farther truths (metres) are ignored. Above 0.
  double max_depth_m = std::numeric_limits<double>::infinity();

  template <typename Self, typename Visit>
  static void fields(Self& self, Visit&& visit) {
    visit("tolerance_px", self.tolerance_px, Allowed::from(0, 100, "from 0 to 100 (pixels)"));
    visit("max_depth_m", self.max_depth_m, Allowed::above(0, "above 0 (metres)"));
  }
  void validate() const { requireFields(*this); }
};

/// Returns whether a pixel of a depth map (metres) has a depth: finite and above 0.
inline bool isDepth(float depth_m) { return std::isfinite(depth_m) && depth_m > 0; }

/// A depth map and its truth, of the same size, metres.
struct ComparedDepths {
  cv::Mat1f estimate;
  cv::Mat1f truth;
  cv::Mat1b mask = {};  ///< Pixels that are evaluated: not 0. Empty: all.

  bool counts(int y, int x) const { return mask.empty() || mask(y, x) != 0; }
  bool hasEstimate(int y, int x) const { return counts(y, x) && isDepth(estimate(y, x)); }
  bool hasTruth(int y, int x, const DepthPairingOptions& options) const {
    return counts(y, x) && isDepth(truth(y, x)) && truth(y, x) <= options.max_depth_m;
  }
  void validate() const;
};

/// Returns the truth for the estimate at a pixel, metres; 0 if there is no truth within the
/// tolerance.
double bestTruth(const ComparedDepths& depths, cv::Point pixel, const DepthPairingOptions& options);

/// Returns the pairs of all pixels at which both maps have a depth, row by row.
std::vector<DepthPair> pairDepths(const ComparedDepths& depths,
                                  const DepthPairingOptions& options = {});

/// Errors over a set of pixels. Z is the estimate, Z_true the truth, d = ln Z - ln Z_true. All are
/// 0 without points.
struct DepthErrors {
  std::uint64_t points = 0;
  double mean_abs_m = 0;    ///< Mean |Z - Z_true| (Ghosh and Gallego 2022, Table II).
  double median_abs_m = 0;  ///< Median |Z - Z_true| (ibid.).
  /// Median |1/Z - 1/Z_true|, in 1/m. Depth planes have an equal spacing in it.
  double median_inverse = 0;
  /// Fraction with a disparity error over 5 px and over 5 % of the true disparity, as in the
  /// scripts of the paper. Needs focal length times baseline.
  std::optional<double> bad_pix_5px;
  /// Fraction with a disparity error over 3 px and over 5 % (Geiger et al., CVPR 2012; KITTI 2015).
  std::optional<double> bad_pix_3px;
  /// Scale-invariant logarithmic error, 100 (mean d^2 - (mean d)^2): the variance of d (Eigen et
  /// al., NIPS 2014, Eq. 1 with lambda = 1, as in KITTI's depth benchmark and Ye et al. 2019).
  double silog = 0;
  /// Mean |Z - Z_true| / Z_true (Ghosh and Gallego 2022, "AErrR"; Ye et al. 2019).
  double aerrr = 0;
  /// Mean |Z - Z_true| / Z, as in the scripts of the paper.
  double aerrr_by_estimate = 0;
  double log_rmse = 0;  ///< 100 sqrt(mean d^2) (Eigen et al., NIPS 2014, "RMSE log").
  /// Fractions with max(Z/Z_true, Z_true/Z) under 1.25, 1.25^2 and 1.25^3 (Ladicky et al., CVPR
  /// 2014; Eigen et al., NIPS 2014).
  std::array<double, 3> delta{};
  /// Fraction with |Z - Z_true| over a tenth of Z_true.
  double beyond_tenth = 0;
};

/// @param focal_baseline focal length in pixels times baseline in metres, above 0. The disparity is
/// focal_baseline / Z.
DepthErrors depthErrors(const std::vector<DepthPair>& pairs,
                        std::optional<double> focal_baseline = std::nullopt);

/// Returns the mean of each field over the maps with points, with equal weights. `points` is their
/// sum. A field that any map lacks is empty.
DepthErrors meanOfErrors(const std::vector<DepthErrors>& maps);

/// Precision (the fraction of the estimates that are correct) and recall (the fraction of the truth
/// that was found) over a list of allowed errors (Pizzoli et al., ICRA 2014; Ghosh and Gallego
/// 2022, Sec. 4, "Metrics"). Stored as counts, which can be added over maps.
struct PrecisionRecall {
  /// The counts at one allowed error.
  struct Step {
    double threshold_m = 0;
    std::uint64_t correct_estimates = 0;
    std::uint64_t found_truths = 0;
  };
  std::vector<Step> steps;
  std::uint64_t estimates = 0;  ///< Pixels with an estimate and a truth.
  std::uint64_t truths = 0;     ///< Pixels with a truth.
  /// Pixels with an estimate and no truth: in none of the other counts.
  std::uint64_t estimates_without_truth = 0;

  /// Returns the fraction of the estimates within the threshold of the truth; 0 without estimates.
  double precision(std::size_t step) const;
  /// Returns the fraction of the truths with an estimate within the threshold; 0 without truths.
  double recall(std::size_t step) const;
  /// Returns the harmonic mean of precision and recall; 0 if both are 0.
  double f1(std::size_t step) const;

  /// Adds the counts of another map.
  /// @throws std::invalid_argument if its thresholds differ.
  void add(const PrecisionRecall& other);
};

/// Returns thresholds from 1 cm to 5 m, about even in the logarithm, for rooms and streets.
std::vector<double> defaultDepthThresholds();

/// Counts pixels with |Z - Z_true| <= threshold. An estimate is compared with its truth as in
/// `pairDepths`. A truth is compared with the estimate of the nearest depth within the tolerance.
/// @param thresholds_m above 0, in any order; the steps have the same order.
PrecisionRecall precisionRecall(const ComparedDepths& depths,
                                const std::vector<double>& thresholds_m,
                                const DepthPairingOptions& options = {});

}  // namespace efm
