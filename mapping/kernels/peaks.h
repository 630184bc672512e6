// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>

#include "mapping/kernels/instruction_set.h"

namespace efm::kernels {

/// The best value so far of each pixel: arrays owned by the caller, that need no alignment.
struct PeakArrays {
  float* best = nullptr;          ///< The largest value; of equals the first.
  std::int32_t* plane = nullptr;  ///< Its plane.
  float* before = nullptr;        ///< The value one plane before it; -1 where there was none.
  float* after = nullptr;         ///< The value one plane after it; -1 where there was none.
  float* previous = nullptr;      ///< The value of the plane added last.
};

struct PeakFunctions {
  /// Adds the n values of the plane that follows the last one.
  void (*add)(const PeakArrays& peaks, std::int32_t plane, const float* values,
              std::size_t n) = nullptr;
};

/// @param kernel one of `availableKernels`. All of them give the bits of the plain one.
const PeakFunctions& peakFunctions(VotingKernel kernel);

}  // namespace efm::kernels
