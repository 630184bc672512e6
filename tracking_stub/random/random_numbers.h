// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cmath>
#include <cstdint>

namespace efm {

/// Seeded random numbers that are the same on every platform, which the distributions of <random>
/// do not promise (SplitMix64: Steele, Lea and Flood, OOPSLA 2014).
class RandomNumbers {
 public:
  /// @param stream numbers of different streams of one seed are unrelated.
  explicit RandomNumbers(std::uint64_t seed, std::uint64_t stream = 0)
      : state_(mix(seed) ^ mix(~stream)) {}

  /// Uniform in [0, 1).
  double uniform() { return static_cast<double>(next() >> 11) * 0x1p-53; }
  /// Uniform in [from, to).
  double uniform(double from, double to) { return from + (to - from) * uniform(); }
  /// Uniform in {0, ..., count - 1}.
  int below(int count) { return static_cast<int>(uniform() * count); }
  /// Normal, of mean 0 and standard deviation 1 (Box and Muller, Ann. Math. Statist. 1958). Takes
  /// two of `next`.
  double normal() {
    constexpr double kTwoPi = 6.283185307179586;
    const double radius = std::sqrt(-2 * std::log(1 - uniform()));
    return radius * std::cos(kTwoPi * uniform());
  }
  std::uint64_t next() { return mix(state_ += 0x9e3779b97f4a7c15U); }

 private:
  static std::uint64_t mix(std::uint64_t z) {
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9U;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebU;
    return z ^ (z >> 31);
  }

  std::uint64_t state_;
};

}  // namespace efm
