// SPDX-License-Identifier: BSD-3-Clause
#include "maps/metrics/sample_statistics.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "mapping/base/option.h"
#include "mapping/depth/peak_fit.h"

namespace efm {

SampleStatistics statisticsOf(const std::vector<double>& values) {
  SampleStatistics statistics;
  statistics.count = values.size();
  if (values.empty()) return statistics;
  const auto count = static_cast<double>(values.size());
  double sum = 0;
  double squares = 0;
  for (const double value : values) {
    sum += value;
    squares += value * value;
  }
  statistics.mean = sum / count;
  statistics.rms = std::sqrt(squares / count);
  double differences = 0;
  for (const double value : values) {
    differences += (value - statistics.mean) * (value - statistics.mean);
  }
  statistics.stddev = std::sqrt(differences / count);
  const auto [min, max] = std::minmax_element(values.begin(), values.end());
  statistics.min = *min;
  statistics.max = *max;
  statistics.median = medianOf(values);
  return statistics;
}

double medianOf(std::vector<double> values) {
  if (values.empty()) return 0;
  const double upper = upperMedian(values);
  if (values.size() % 2 == 1) return upper;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  return 0.5 * (upper + *std::max_element(values.begin(), middle));
}

double quantileOf(std::vector<double> values, double fraction) {
  requireOption(fraction > 0 && fraction <= 1, "fraction", fraction, "above 0 and at most 1");
  if (values.empty()) return 0;
  // The slack is for fractions like 0.9, whose product with 10 is a little above 9.
  const double rank = std::ceil(fraction * static_cast<double>(values.size()) * (1 - 1e-12));
  const auto at = values.begin() + static_cast<std::ptrdiff_t>(std::max(1.0, rank)) - 1;
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

}  // namespace efm
