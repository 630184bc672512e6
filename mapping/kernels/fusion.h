// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>

#include "mapping/kernels/instruction_set.h"
#include "mapping/kernels/tile_pixels.h"

namespace efm::kernels {

/// One rule's arithmetic over n voxels. Pointers need no alignment, and nothing beyond n is
/// touched. A voxel's result depends on its values alone, not on n nor on its place.
struct FusionSteps {
  float start = 0;  ///< What the sum starts from.
  /// An input joins the sum.
  void (*fold)(float* sum, const float* values, std::size_t n) = nullptr;
  /// What the sum of so many inputs means: the sum becomes the mean.
  void (*finish)(float* sum, float inputs, std::size_t n) = nullptr;
  /// The mean of two inputs, in place of the first: the same without a sum in between.
  void (*pair)(float* values, const float* others, std::size_t n) = nullptr;
  /// Adds the mean of two inputs to a sum in some blocks of a tile; no pixel that lies outside them
  /// is touched.
  void (*addPair)(float* sum, const float* values, const float* others,
                  const PixelBlocks& blocks) = nullptr;
};

struct FusionFunctions {
  FusionSteps min;
  FusionSteps harmonic;
  FusionSteps geometric;
  FusionSteps arithmetic;
  FusionSteps rms;
  FusionSteps max;
};

/// The plain scalar functions: the specification. Vectors give the same bits for min, harmonic,
/// arithmetic, max and the geometric mean of two. Their rms is within 2e-7 of it, having rounded
/// once less; their logarithms and exponentials are within 5e-7 of it (below 1, of 1), and are
/// exact for zero.
const FusionFunctions& plainFusion();

/// @param kernel one of `runnableKernels`.
const FusionFunctions& fusionFunctions(VotingKernel kernel);

}  // namespace efm::kernels
