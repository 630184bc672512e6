// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>

namespace efm::kernels {

/// One rule's arithmetic over n voxels. Pointers need no alignment, and nothing beyond n is
/// touched.
struct FusionSteps {
  float start = 0;  ///< The sum before the first input.
  /// Adds an input to the sum.
  void (*fold)(float* sum, const float* values, std::size_t n) = nullptr;
  /// Turns the sum of the inputs into their mean.
  void (*finish)(float* sum, float inputs, std::size_t n) = nullptr;
  /// Replaces the first of two inputs by their mean, without a sum in between.
  void (*pair)(float* values, const float* others, std::size_t n) = nullptr;
};

struct FusionFunctions {
  FusionSteps min;
  FusionSteps harmonic;
  FusionSteps geometric;
  FusionSteps arithmetic;
  FusionSteps rms;
  FusionSteps max;
};

/// Plain functions: kernels per instruction set would save 2 % of a sweep.
const FusionFunctions& fusionFunctions();

}  // namespace efm::kernels
