// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <vector>

namespace efm {

/// Statistics of a list; all are 0 for an empty list.
struct SampleStatistics {
  std::uint64_t count = 0;
  double rms = 0;  ///< Root of the mean square.
  double mean = 0;
  double median = 0;
  double stddev = 0;  ///< Root of the mean squared difference from the mean (over n, not n - 1).
  double min = 0;
  double max = 0;
};

SampleStatistics statisticsOf(const std::vector<double>& values);

/// Returns the middle value, or the mean of the two middle values; 0 for an empty list.
double medianOf(std::vector<double> values);

/// Returns the quantile: the smallest value of the list with at least this fraction of the list at
/// or below it; 0 for an empty list.
/// @param fraction above 0, at most 1.
double quantileOf(std::vector<double> values, double fraction);

}  // namespace efm
