// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

namespace efm {

/// What the inner loops are made of: plain scalar code, the specification, or vectors of one
/// instruction set. From slow to fast within an architecture.
enum class VotingKernel {
  kPlain,
  kBaseline,  ///< Vectors as any processor of the architecture has them.
  kSse4,
  kAvx2,    ///< With FMA, BMI2 and F16C.
  kAvx512,  ///< F, BW, CD, DQ and VL.
  kNeon,
};

}  // namespace efm

namespace efm::kernels {

/// What this build has and this processor can run, in the order of `VotingKernel`.
std::vector<VotingKernel> runnableKernels();

}  // namespace efm::kernels
