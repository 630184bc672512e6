// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <cstdint>

namespace efm {

/// Seeded random numbers (SplitMix64: Steele, Lea and Flood, OOPSLA 2014). They are the same on
/// every platform; the distributions of <random> are not the same.
class RandomNumbers {
 public:
  /// @param stream number of the stream. The streams of a seed are independent.
  explicit RandomNumbers(std::uint64_t seed, std::uint64_t stream = 0)
      : state_(mix(seed) ^ mix(~stream)) {}

  /// Returns a uniform number in [0, 1).
  double uniform() { return static_cast<double>(next() >> 11) * 0x1p-53; }
  /// Returns a uniform number in [from, to).
  double uniform(double from, double to) { return from + (to - from) * uniform(); }
  /// Returns a uniform number in {0, ..., count - 1}.
  int below(int count) { return static_cast<int>(uniform() * count); }
  /// Returns a normal number with mean 0 and standard deviation 1 (Box and Muller, Ann. Math.
  /// Statist. 1958). Uses two numbers of `next`.
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

/// Returns a vector with a normal number of standard deviation 1 on each axis.
inline Eigen::Vector3d normalVector(RandomNumbers& random) {
  Eigen::Vector3d values;
  for (int axis = 0; axis < 3; ++axis) values[axis] = random.normal();
  return values;
}

/// Returns a direction, uniform on the unit sphere.
inline Eigen::Vector3d randomDirection(RandomNumbers& random) {
  return normalVector(random).normalized();
}

}  // namespace efm
