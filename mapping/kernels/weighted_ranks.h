// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>

#include "mapping/kernels/instruction_set.h"

namespace efm::kernels {

/// Vectors may read and write this number of values past the end.
inline constexpr std::size_t kRankPadding = 16;

/// Ranks of a few weighted positions. Sums over all pairs have no branches: up to a hundred
/// positions they are faster than sorting.
struct RankFunctions {
  /// Adds to each position's sum the weights of all positions at or below it. All arrays have n
  /// values and kRankPadding.
  void (*add)(float* below, const float* positions, const float* weights, std::size_t n) = nullptr;
};

/// @param kernel one of `availableKernels`. All of them give the bits of the plain one.
const RankFunctions& rankFunctions(VotingKernel kernel);

}  // namespace efm::kernels
