// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string_view>
#include <vector>

#include "mapping/kernels/instruction_set.h"

namespace efm {

/// "plain", "baseline", "sse4", "avx2", "avx512", "neon".
std::string_view nameOf(VotingKernel kernel);
/// Accepts kernels that this processor lacks.
/// @throws std::invalid_argument naming the value and the known names.
VotingKernel votingKernelFromName(std::string_view name);

/// The kernels that this build has and this processor can run, plain first.
const std::vector<VotingKernel>& availableKernels();
bool isAvailable(VotingKernel kernel);

/// The fastest of some kernels, plain among them. Measured, as a multiple of plain's speed:
/// baseline 0.6 to 1, SSE4 2 to 2.2, AVX2 2.2 to 2.6, AVX-512 3.2 to 4.6 (docs/performance.md).
/// NEON has not been measured: its vectors are as long as SSE4's, and the code is the same.
VotingKernel fastestOf(const std::vector<VotingKernel>& kernels);
/// Of `availableKernels`.
VotingKernel fastestKernel();

}  // namespace efm
