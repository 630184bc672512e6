// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

namespace efm {

/// The code of the inner loops: plain scalar code, the specification, or vectors of one instruction
/// set. Vectors from slow to fast within an architecture.
enum class VotingKernel {
  kPlain,
  kBaseline,  ///< What any processor of the architecture has. Slower than plain.
  kSse4,
  kAvx2,    ///< With FMA, BMI2 and F16C.
  kAvx512,  ///< F, BW, CD, DQ and VL.
  kNeon,
};

}  // namespace efm

namespace efm::kernels {

/// The kernels that this build has and this processor can run, in the order of `VotingKernel`.
std::vector<VotingKernel> availableKernels();

}  // namespace efm::kernels
