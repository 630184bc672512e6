// SPDX-License-Identifier: BSD-3-Clause
#include "maps/metrics/depth_metrics.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>

#include "mapping/base/named_choice.h"
#include "maps/metrics/sample_statistics.h"

namespace efm {
namespace {

constexpr double kDeltaBase = 1.25;

/// Fraction of the pairs that meet a condition.
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

/// Fraction of the pairs with a disparity error over `limit_px` and over 5 %.
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

  // Differences from the mean: no large squares cancel.
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

}  // namespace efm
