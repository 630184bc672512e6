// SPDX-License-Identifier: BSD-3-Clause
#include "maps/metrics/depth_pairs.h"

#include <algorithm>
#include <stdexcept>
#include <string>

#include "mapping/base/named_choice.h"

namespace efm {
namespace {

std::string sizeText(const cv::Mat& image) {
  return std::to_string(image.cols) + "x" + std::to_string(image.rows);
}

}  // namespace

void DepthPairingOptions::validate() const {
  requireOption(tolerance_px >= 0 && tolerance_px <= 100, "tolerance_px", tolerance_px,
                "from 0 to 100 (pixels)");
  requireOption(max_depth_m > 0, "max_depth_m", max_depth_m, "above 0 (metres)");
}

void ComparedDepths::validate() const {
  if (estimate.size() != truth.size()) {
    throw std::invalid_argument("the maps differ in size: the estimate has " + sizeText(estimate) +
                                " pixels, the truth " + sizeText(truth));
  }
  if (!mask.empty() && mask.size() != truth.size()) {
    throw std::invalid_argument("the mask has " + sizeText(mask) + " pixels, the maps " +
                                sizeText(truth));
  }
}

double bestTruth(const ComparedDepths& depths, cv::Point pixel,
                 const DepthPairingOptions& options) {
  const double estimate_m = depths.estimate(pixel);
  double best_m = 0;
  double best_error = std::numeric_limits<double>::infinity();
  const int tolerance = options.tolerance_px;
  const int bottom = std::min(depths.truth.rows - 1, pixel.y + tolerance);
  const int right = std::min(depths.truth.cols - 1, pixel.x + tolerance);
  for (int y = std::max(0, pixel.y - tolerance); y <= bottom; ++y) {
    for (int x = std::max(0, pixel.x - tolerance); x <= right; ++x) {
      if (!depths.hasTruth(y, x, options)) continue;
      const double candidate_m = depths.truth(y, x);
      const double error = std::abs(1 / estimate_m - 1 / candidate_m);
      if (error < best_error) {
        best_error = error;
        best_m = candidate_m;
      }
    }
  }
  return best_m;
}

std::vector<DepthPair> pairDepths(const ComparedDepths& depths,
                                  const DepthPairingOptions& options) {
  options.validate();
  depths.validate();
  std::vector<DepthPair> pairs;
  for (int y = 0; y < depths.estimate.rows; ++y) {
    for (int x = 0; x < depths.estimate.cols; ++x) {
      if (!depths.hasEstimate(y, x)) continue;
      const double truth_m = bestTruth(depths, {x, y}, options);
      if (truth_m > 0) pairs.push_back({depths.estimate(y, x), truth_m});
    }
  }
  return pairs;
}

std::vector<DepthPair> pairDepths(const cv::Mat1f& estimate, const cv::Mat1f& truth,
                                  const DepthPairingOptions& options) {
  return pairDepths(ComparedDepths{estimate, truth, {}}, options);
}

}  // namespace efm
