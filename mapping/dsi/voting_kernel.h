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

/// The kernels that this build has and this processor can run: plain first, the fastest last.
const std::vector<VotingKernel>& availableKernels();
bool isAvailable(VotingKernel kernel);
VotingKernel fastestKernel();

}  // namespace efm
