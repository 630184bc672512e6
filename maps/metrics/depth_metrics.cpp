// SPDX-License-Identifier: BSD-3-Clause
#include "maps/metrics/depth_metrics.h"

#include <algorithm>
#include <cstddef>
#include <stdexcept>
#include <string>
#include <utility>

#include "mapping/base/option.h"
#include "maps/metrics/sample_statistics.h"

namespace efm {
namespace {

std::string sizeText(const cv::Mat& image) {
  return std::to_string(image.cols) + "x" + std::to_string(image.rows);
}

cv::Rect windowAround(const cv::Mat& image, cv::Point pixel, int radius) {
  const int side = 2 * radius + 1;
  return cv::Rect(pixel.x - radius, pixel.y - radius, side, side) & cv::Rect({0, 0}, image.size());
}

}  // namespace

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
  const cv::Rect window = windowAround(depths.truth, pixel, options.tolerance_px);
  for (int y = window.y; y < window.br().y; ++y) {
    for (int x = window.x; x < window.br().x; ++x) {
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

namespace {

constexpr double kDeltaBase = 1.25;

/// Returns the fraction of the pairs that meet a condition.
template <typename Condition>
double fractionWith(const std::vector<DepthPair>& pairs, Condition condition) {
  if (pairs.empty()) return 0;
  const auto count = std::count_if(pairs.begin(), pairs.end(), condition);
  return static_cast<double>(count) / static_cast<double>(pairs.size());
}

template <typename Value>
double meanOf(const std::vector<DepthPair>& pairs, Value value) {
  if (pairs.empty()) return 0;
  double sum = 0;
  for (const DepthPair& pair : pairs) sum += value(pair);
  return sum / static_cast<double>(pairs.size());
}

template <typename Value>
double medianOf(const std::vector<DepthPair>& pairs, Value value) {
  std::vector<double> values;
  values.reserve(pairs.size());
  for (const DepthPair& pair : pairs) values.push_back(value(pair));
  return efm::medianOf(std::move(values));
}

double absoluteError(const DepthPair& pair) { return std::abs(pair.estimate_m - pair.truth_m); }
double logarithmicError(const DepthPair& pair) {
  return std::log(pair.estimate_m) - std::log(pair.truth_m);
}

/// Returns the fraction of the pairs with a disparity error over `limit_px` and over 5 %.
double badPixels(const std::vector<DepthPair>& pairs, double focal_baseline, double limit_px) {
  return fractionWith(pairs, [&](const DepthPair& pair) {
    const double truth_px = focal_baseline / pair.truth_m;
    const double error_px = std::abs(focal_baseline / pair.estimate_m - truth_px);
    return error_px > limit_px && error_px > 0.05 * truth_px;
  });
}

}  // namespace

DepthErrors depthErrors(const std::vector<DepthPair>& pairs, std::optional<double> focal_baseline) {
  DepthErrors errors;
  errors.points = pairs.size();
  errors.mean_abs_m = meanOf(pairs, absoluteError);
  errors.median_abs_m = medianOf(pairs, absoluteError);
  errors.median_inverse = medianOf(pairs, [](const DepthPair& pair) {
    return std::abs(1 / pair.estimate_m - 1 / pair.truth_m);
  });
  if (focal_baseline) {
    requireOption(*focal_baseline > 0, "focal_baseline", *focal_baseline, "above 0");
    errors.bad_pix_5px = badPixels(pairs, *focal_baseline, 5);
    errors.bad_pix_3px = badPixels(pairs, *focal_baseline, 3);
  }

  // With differences from the mean, no large squares cancel.
  const double mean_d = meanOf(pairs, logarithmicError);
  const double variance_d = meanOf(pairs, [mean_d](const DepthPair& pair) {
    return (logarithmicError(pair) - mean_d) * (logarithmicError(pair) - mean_d);
  });
  errors.silog = 100 * variance_d;
  errors.log_rmse = 100 * std::sqrt(variance_d + mean_d * mean_d);
  errors.aerrr =
      meanOf(pairs, [](const DepthPair& pair) { return absoluteError(pair) / pair.truth_m; });
  errors.aerrr_by_estimate =
      meanOf(pairs, [](const DepthPair& pair) { return absoluteError(pair) / pair.estimate_m; });
  for (std::size_t k = 0; k < errors.delta.size(); ++k) {
    const double limit = std::pow(kDeltaBase, static_cast<double>(k + 1));
    errors.delta[k] = fractionWith(pairs, [limit](const DepthPair& pair) {
      return std::max(pair.estimate_m / pair.truth_m, pair.truth_m / pair.estimate_m) < limit;
    });
  }
  errors.beyond_tenth = fractionWith(
      pairs, [](const DepthPair& pair) { return absoluteError(pair) > 0.1 * pair.truth_m; });
  return errors;
}

DepthErrors meanOfErrors(const std::vector<DepthErrors>& maps) {
  std::vector<DepthErrors> given;
  for (const DepthErrors& map : maps) {
    if (map.points > 0) given.push_back(map);
  }
  DepthErrors mean;
  if (given.empty()) return mean;
  const auto mean_over = [&](auto value) {
    double sum = 0;
    for (const DepthErrors& map : given) sum += value(map);
    return sum / static_cast<double>(given.size());
  };
  const auto average = [&](double DepthErrors::*field) {
    mean.*field = mean_over([field](const DepthErrors& map) { return map.*field; });
  };
  const auto average_where_all_have = [&](std::optional<double> DepthErrors::*field) {
    const bool all = std::all_of(given.begin(), given.end(),
                                 [&](const DepthErrors& map) { return (map.*field).has_value(); });
    if (all) mean.*field = mean_over([&](const DepthErrors& map) { return *(map.*field); });
  };
  for (const DepthErrors& map : given) mean.points += map.points;
  average(&DepthErrors::mean_abs_m);
  average(&DepthErrors::median_abs_m);
  average(&DepthErrors::median_inverse);
  average_where_all_have(&DepthErrors::bad_pix_5px);
  average_where_all_have(&DepthErrors::bad_pix_3px);
  average(&DepthErrors::silog);
  average(&DepthErrors::aerrr);
  average(&DepthErrors::aerrr_by_estimate);
  average(&DepthErrors::log_rmse);
  for (std::size_t k = 0; k < mean.delta.size(); ++k) {
    mean.delta[k] = mean_over([k](const DepthErrors& map) { return map.delta[k]; });
  }
  average(&DepthErrors::beyond_tenth);
  return mean;
}

namespace {

double fractionOf(std::uint64_t part, std::uint64_t whole) {
  return whole == 0 ? 0 : static_cast<double>(part) / static_cast<double>(whole);
}

/// Returns the minimum error of the estimates within the tolerance around a pixel with a truth,
/// metres; infinite without estimates.
double minError(const ComparedDepths& depths, cv::Point pixel, int tolerance) {
  const double truth_m = depths.truth(pixel);
  double min_m = std::numeric_limits<double>::infinity();
  const cv::Rect window = windowAround(depths.estimate, pixel, tolerance);
  for (int y = window.y; y < window.br().y; ++y) {
    for (int x = window.x; x < window.br().x; ++x) {
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
