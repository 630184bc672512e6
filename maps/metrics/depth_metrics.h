// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "maps/metrics/depth_pairs.h"

namespace efm {

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
  /// The same divided by Z, as in the scripts of the paper.
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
/// @throws std::invalid_argument where focal_baseline is not above 0.
DepthErrors depthErrors(const std::vector<DepthPair>& pairs,
                        std::optional<double> focal_baseline = std::nullopt);

/// The mean of each field over the maps with points, with equal weights. `points` is their sum. A
/// field that a map lacks is empty.
DepthErrors meanOfErrors(const std::vector<DepthErrors>& maps);

}  // namespace efm
