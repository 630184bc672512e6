// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <vector>

namespace efm {

/// What a list of numbers is like. All are 0 where there is none.
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

/// The value in the middle; of an even number the mean of the two in the middle; 0 of none.
double medianOf(std::vector<double> values);

/// The smallest of the values that at least this share of them does not exceed; 0 of none.
/// @param share above 0, at most 1.
double quantileOf(std::vector<double> values, double share);

}  // namespace efm
