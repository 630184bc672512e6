// SPDX-License-Identifier: BSD-3-Clause
#include "test/bench/growth_fit.h"

#include <cmath>
#include <cstddef>
#include <numeric>
#include <stdexcept>
#include <string>

namespace efm::bench {
namespace {

std::vector<double> logarithms(const std::vector<double>& values, const char* what) {
  std::vector<double> logs;
  for (const double value : values) {
    if (!(value > 0) || !std::isfinite(value)) {
      throw std::invalid_argument(std::string(what) + " = " + std::to_string(value) +
                                  ": expected above 0");
    }
    logs.push_back(std::log(value));
  }
  return logs;
}

double meanOf(const std::vector<double>& values) {
  return std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
}

}  // namespace

double fittedExponent(const std::vector<double>& sizes, const std::vector<double>& times) {
  if (sizes.size() != times.size()) {
    throw std::invalid_argument(std::to_string(times.size()) + " times of " +
                                std::to_string(sizes.size()) + " sizes: expected equally many");
  }
  const std::vector<double> x = logarithms(sizes, "size");
  const std::vector<double> y = logarithms(times, "time");
  const double mean_x = meanOf(x);
  const double mean_y = meanOf(y);
  double xx = 0;
  double xy = 0;
  for (std::size_t i = 0; i < x.size(); ++i) {
    xx += (x[i] - mean_x) * (x[i] - mean_x);
    xy += (x[i] - mean_x) * (y[i] - mean_y);
  }
  if (!(xx > 0)) throw std::invalid_argument("sizes: expected at least two different ones");
  return xy / xx;
}

}  // namespace efm::bench
