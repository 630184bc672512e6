// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <string_view>
#include <vector>

#include "mapping/dsi/plane_values.h"
#include "mapping/dsi/voting_kernel.h"

namespace efm {

namespace kernels {
struct FusionSteps;
struct PixelBlocks;
}  // namespace kernels

/// How the ray densities of several DSIs become one, voxel by voxel (Ghosh and Gallego 2022,
/// Eqs. 6-11): means of n inputs with equal weights, symmetric, and ordered
/// min <= harmonic <= geometric <= arithmetic <= rms <= max.
enum class FusionRule { kMin, kHarmonic, kGeometric, kArithmetic, kRms, kMax };

/// "min", "harmonic", "geometric", "arithmetic", "rms", "max".
std::string_view nameOf(FusionRule rule);
/// @throws std::invalid_argument naming the value and what is known.
FusionRule fusionRuleFromName(std::string_view name);
/// Whether zero in any input makes the mean zero.
bool isAndLike(FusionRule rule);
/// All rules, in their order.
const std::vector<FusionRule>& allFusionRules();

/// A running mean of planes under one rule: all six rules fold, so that one plane of memory serves
/// any number of inputs. Inputs are ray densities, not negative; zero in any input makes the
/// AND-like rules (min, harmonic, geometric) zero. One input is its own mean, bit for bit.
///
/// Use: `begin`, `fold` per input, `finish`; then `values` holds the mean.
class FusionAccumulator {
 public:
  /// @param kernel an available one.
  FusionAccumulator(FusionRule rule, std::size_t voxels, VotingKernel kernel = fastestKernel());

  /// @param inputs how many will be folded. With none the mean is zero.
  void begin(int inputs);
  /// @param values as many as there are voxels, or `values` itself: see `place`.
  void fold(const float* values);
  void finish();

  /// Adds the mean of two inputs to a sum, in some blocks of a tile: the first input lies in
  /// `place`.
  void addPair(const float* second, const kernels::PixelBlocks& blocks, PlaneValues& sum) const;

  const PlaneValues& values() const { return values_; }

  /// Where the first of two inputs may be written before it is folded, which saves a copy.
  PlaneValues& place() { return values_; }

 private:
  const kernels::FusionSteps* steps_;
  int inputs_ = 0;
  int folded_ = 0;
  PlaneValues values_;
};

}  // namespace efm
