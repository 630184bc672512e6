// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <string_view>
#include <vector>

#include "mapping/dsi/plane_values.h"

namespace efm {

namespace kernels {
struct FusionSteps;
}  // namespace kernels

/// How the ray densities of several DSIs become one, voxel by voxel (Ghosh and Gallego 2022,
/// Eqs. 6-11): means of n inputs with equal weights, symmetric, and ordered
/// min <= harmonic <= geometric <= arithmetic <= rms <= max.
enum class FusionRule { kMin, kHarmonic, kGeometric, kArithmetic, kRms, kMax };

/// "min", "harmonic", "geometric", "arithmetic", "rms", "max".
std::string_view nameOf(FusionRule rule);
/// @throws std::invalid_argument naming the value and the known names.
FusionRule fusionRuleFromName(std::string_view name);
/// Whether zero in any input makes the mean zero.
bool isAndLike(FusionRule rule);
/// All rules, in their order.
const std::vector<FusionRule>& allFusionRules();
/// The rule's arithmetic.
const kernels::FusionSteps& stepsOf(FusionRule rule);

/// The mean of planes under one rule. Inputs are added one by one, so that one plane of memory
/// serves any number of them. Inputs are ray densities, not negative. One input is its own mean,
/// bit for bit.
class FusionAccumulator {
 public:
  /// @param inputs of each mean; at least 1.
  FusionAccumulator(FusionRule rule, int inputs, std::size_t voxels);

  /// A plane for the next input. It saves a copy where that input becomes the mean's first value.
  PlaneValues& next();
  /// Adds an input. The first one after a complete mean begins the next mean.
  /// @param values a plane of voxels, or `next()`.
  void add(const PlaneValues& values);
  /// Whether all inputs of the mean are added.
  bool isComplete() const { return added_ == inputs_; }
  /// The complete mean.
  const PlaneValues& mean() const { return mean_; }

 private:
  bool isFirst() const { return added_ == 0 || isComplete(); }

  const kernels::FusionSteps* steps_;
  int inputs_;
  int added_ = 0;
  PlaneValues mean_;
  PlaneValues next_;
};

}  // namespace efm
