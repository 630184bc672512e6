// SPDX-License-Identifier: BSD-3-Clause
#include "maps/depth_metrics.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "mapping/option_check.h"

namespace efm {
namespace {

bool isDepth(float depth_m) { return std::isfinite(depth_m) && depth_m > 0; }

/// The truth nearest to the estimate in inverse depth in the window around a pixel; 0 where there
/// is none.
double bestTruth(const cv::Mat1f& truth, cv::Point pixel, double estimate_m,
                 const DepthPairingOptions& options) {
  double best_m = 0;
  double best_error = std::numeric_limits<double>::infinity();
  const int reach = options.tolerance_px;
  for (int y = std::max(0, pixel.y - reach); y <= std::min(truth.rows - 1, pixel.y + reach); ++y) {
    for (int x = std::max(0, pixel.x - reach); x <= std::min(truth.cols - 1, pixel.x + reach);
         ++x) {
      const double candidate_m = truth(y, x);
      if (!isDepth(truth(y, x)) || candidate_m > options.max_depth_m) continue;
      const double error = std::abs(1 / estimate_m - 1 / candidate_m);
      if (error < best_error) {
        best_error = error;
        best_m = candidate_m;
      }
    }
  }
  return best_m;
}

double median(std::vector<double> values) {
  if (values.empty()) return 0;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  if (values.size() % 2 == 1) return *middle;
  return 0.5 * (*middle + *std::max_element(values.begin(), middle));
}

/// Share of the pairs whose disparity is off by more than `limit_px` and 5 %.
double badShare(const std::vector<DepthPair>& pairs, double focal_baseline, double limit_px) {
  if (pairs.empty()) return 0;
  const auto bad = std::count_if(pairs.begin(), pairs.end(), [&](const DepthPair& pair) {
    const double truth_px = focal_baseline / pair.truth_m;
    const double error_px = std::abs(focal_baseline / pair.estimate_m - truth_px);
    return error_px > limit_px && error_px > 0.05 * truth_px;
  });
  return static_cast<double>(bad) / static_cast<double>(pairs.size());
}

}  // namespace

void DepthPairingOptions::validate() const {
  requireOption(tolerance_px >= 0 && tolerance_px <= 100, "tolerance_px", tolerance_px,
                "from 0 to 100 (pixels)");
  requireOption(max_depth_m > 0, "max_depth_m", max_depth_m, "above 0 (metres)");
}

std::vector<DepthPair> pairDepths(const cv::Mat1f& estimate, const cv::Mat1f& truth,
                                  const DepthPairingOptions& options) {
  options.validate();
  if (estimate.size() != truth.size()) {
    throw std::invalid_argument("the maps differ in size: the estimate has " +
                                std::to_string(estimate.cols) + "x" +
                                std::to_string(estimate.rows) + " pixels, the truth " +
                                std::to_string(truth.cols) + "x" + std::to_string(truth.rows));
  }
  std::vector<DepthPair> pairs;
  for (int y = 0; y < estimate.rows; ++y) {
    for (int x = 0; x < estimate.cols; ++x) {
      if (!isDepth(estimate(y, x))) continue;
      const double estimate_m = estimate(y, x);
      const double truth_m = bestTruth(truth, {x, y}, estimate_m, options);
      if (truth_m > 0) pairs.push_back({estimate_m, truth_m});
    }
  }
  return pairs;
}

DepthErrors depthErrors(const std::vector<DepthPair>& pairs, std::optional<double> focal_baseline) {
  if (focal_baseline) {
    requireOption(*focal_baseline > 0, "focal_baseline", *focal_baseline, "above 0");
  }
  std::vector<double> absolute_m;
  std::vector<double> inverse;
  absolute_m.reserve(pairs.size());
  inverse.reserve(pairs.size());
  double sum_m = 0;
  for (const DepthPair& pair : pairs) {
    absolute_m.push_back(std::abs(pair.estimate_m - pair.truth_m));
    inverse.push_back(std::abs(1 / pair.estimate_m - 1 / pair.truth_m));
    sum_m += absolute_m.back();
  }

  DepthErrors errors;
  errors.points = pairs.size();
  errors.mean_abs_m = pairs.empty() ? 0 : sum_m / static_cast<double>(pairs.size());
  errors.median_abs_m = median(std::move(absolute_m));
  errors.median_inverse = median(std::move(inverse));
  if (focal_baseline) {
    errors.bad_pix_5px = badShare(pairs, *focal_baseline, 5);
    errors.bad_pix_3px = badShare(pairs, *focal_baseline, 3);
  }
  return errors;
}

}  // namespace efm
