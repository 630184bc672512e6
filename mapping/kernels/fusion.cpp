// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/kernels/kernels.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace efm::kernels {
namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity();
constexpr float kSmallest = std::numeric_limits<float>::min();

// A rule is the start of a sum and three small functions: `fold` adds an input to the sum, `finish`
// turns the sum of n inputs into their mean, and `pair` is the mean of two inputs. Zeros need no
// branch in `fold` and `finish`: in IEEE arithmetic, 1/0 and log 0 lead to a mean of zero.

/// Ghosh and Gallego 2022, Eq. 10.
struct Min {
  static constexpr float kStart = kInfinity;
  static float fold(float sum, float value) { return std::min(sum, value); }
  static float finish(float sum, float) { return sum; }
  static float pair(float a, float b) { return std::min(a, b); }
};

/// Ghosh and Gallego 2022, Eq. 8.
struct Harmonic {
  static constexpr float kStart = 0;
  static float fold(float sum, float value) { return sum + 1.0F / value; }
  static float finish(float sum, float inputs) { return inputs / sum; }
  /// Returns 2ab / (a + b) with one division. No product can leave the range of floats, and 0/0
  /// needs no branch.
  static float pair(float a, float b) {
    const float low = std::min(a, b);
    const float high = std::max(a, b);
    return 2 * low * (high / std::max(low + high, kSmallest));
  }
};

/// Ghosh and Gallego 2022, Eq. 7.
struct Geometric {
  static constexpr float kStart = 0;
  static float fold(float sum, float value) { return sum + std::log(value); }
  static float finish(float sum, float inputs) { return std::exp(sum / inputs); }
  static float pair(float a, float b) { return std::sqrt(a) * std::sqrt(b); }
};

/// Ghosh and Gallego 2022, Eq. 6.
struct Arithmetic {
  static constexpr float kStart = 0;
  static float fold(float sum, float value) { return sum + value; }
  static float finish(float sum, float inputs) { return sum / inputs; }
  static float pair(float a, float b) { return (a + b) / 2; }
};

/// Ghosh and Gallego 2022, Eq. 9.
struct Rms {
  static constexpr float kStart = 0;
  static float fold(float sum, float value) { return sum + value * value; }
  static float finish(float sum, float inputs) { return std::sqrt(sum / inputs); }
  static float pair(float a, float b) { return std::sqrt((a * a + b * b) / 2); }
};

/// Ghosh and Gallego 2022, Eq. 11.
struct Max {
  static constexpr float kStart = 0;
  static float fold(float sum, float value) { return std::max(sum, value); }
  static float finish(float sum, float) { return sum; }
  static float pair(float a, float b) { return std::max(a, b); }
};

template <typename Rule>
void fold(float* sum, const float* values, std::size_t n) {
  for (std::size_t i = 0; i < n; ++i) sum[i] = Rule::fold(sum[i], values[i]);
}

template <typename Rule>
void finish(float* sum, float inputs, std::size_t n) {
  for (std::size_t i = 0; i < n; ++i) sum[i] = Rule::finish(sum[i], inputs);
}

template <typename Rule>
void pair(float* values, const float* others, std::size_t n) {
  for (std::size_t i = 0; i < n; ++i) values[i] = Rule::pair(values[i], others[i]);
}

template <typename Rule>
constexpr FusionSteps steps() {
  return {Rule::kStart, fold<Rule>, finish<Rule>, pair<Rule>};
}

}  // namespace

const FusionFunctions& fusionFunctions() {
  static constexpr FusionFunctions kFunctions = {steps<Min>(),       steps<Harmonic>(),
                                                 steps<Geometric>(), steps<Arithmetic>(),
                                                 steps<Rms>(),       steps<Max>()};
  return kFunctions;
}

}  // namespace efm::kernels
