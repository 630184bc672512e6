// SPDX-License-Identifier: BSD-3-Clause
#include "maps/metrics/precision_recall.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <stdexcept>

#include "mapping/base/named_choice.h"

namespace efm {
namespace {

double fractionOf(std::uint64_t part, std::uint64_t whole) {
  return whole == 0 ? 0 : static_cast<double>(part) / static_cast<double>(whole);
}

/// The minimum error of the estimates within the tolerance around a pixel with a truth, metres;
/// infinite without estimates.
double minError(const ComparedDepths& depths, cv::Point pixel, int tolerance) {
  const double truth_m = depths.truth(pixel);
  double min_m = std::numeric_limits<double>::infinity();
  const int bottom = std::min(depths.estimate.rows - 1, pixel.y + tolerance);
  const int right = std::min(depths.estimate.cols - 1, pixel.x + tolerance);
  for (int y = std::max(0, pixel.y - tolerance); y <= bottom; ++y) {
    for (int x = std::max(0, pixel.x - tolerance); x <= right; ++x) {
      if (!depths.hasEstimate(y, x)) continue;
      min_m = std::min(min_m, std::abs(depths.estimate(y, x) - truth_m));
    }
  }
  return min_m;
}

}  // namespace

double PrecisionRecall::precision(std::size_t step) const {
  return fractionOf(steps.at(step).correct_estimates, estimates);
}

double PrecisionRecall::recall(std::size_t step) const {
  return fractionOf(steps.at(step).found_truths, truths);
}

double PrecisionRecall::f1(std::size_t step) const {
  const double p = precision(step);
  const double r = recall(step);
  return p + r > 0 ? 2 * p * r / (p + r) : 0;
}

void PrecisionRecall::add(const PrecisionRecall& other) {
  const bool same =
      std::equal(steps.begin(), steps.end(), other.steps.begin(), other.steps.end(),
                 [](const Step& a, const Step& b) { return a.threshold_m == b.threshold_m; });
  if (!same) throw std::invalid_argument("precision and recall of different thresholds");
  for (std::size_t k = 0; k < steps.size(); ++k) {
    steps[k].correct_estimates += other.steps[k].correct_estimates;
    steps[k].found_truths += other.steps[k].found_truths;
  }
  estimates += other.estimates;
  truths += other.truths;
  estimates_without_truth += other.estimates_without_truth;
}

std::vector<double> defaultDepthThresholds() {
  return {0.01, 0.02, 0.03, 0.05, 0.07, 0.1, 0.15, 0.2, 0.3, 0.5, 0.7, 1, 2, 5};
}

PrecisionRecall precisionRecall(const ComparedDepths& depths,
                                const std::vector<double>& thresholds_m,
                                const DepthPairingOptions& options) {
  options.validate();
  depths.validate();
  PrecisionRecall counts;
  for (const double threshold_m : thresholds_m) {
    requireOption(threshold_m > 0, "threshold", threshold_m, "above 0 (metres)");
    counts.steps.push_back({threshold_m, 0, 0});
  }
  for (int y = 0; y < depths.truth.rows; ++y) {
    for (int x = 0; x < depths.truth.cols; ++x) {
      if (depths.hasEstimate(y, x)) {
        const double truth_m = bestTruth(depths, {x, y}, options);
        ++(truth_m > 0 ? counts.estimates : counts.estimates_without_truth);
        const double error_m = std::abs(depths.estimate(y, x) - truth_m);
        for (PrecisionRecall::Step& step : counts.steps) {
          if (truth_m > 0 && error_m <= step.threshold_m) ++step.correct_estimates;
        }
      }
      if (depths.hasTruth(y, x, options)) {
        ++counts.truths;
        const double error_m = minError(depths, {x, y}, options.tolerance_px);
        for (PrecisionRecall::Step& step : counts.steps) {
          if (error_m <= step.threshold_m) ++step.found_truths;
        }
      }
    }
  }
  return counts;
}

}  // namespace efm
