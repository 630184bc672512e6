// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "mapping/kernels/instruction_set.h"

namespace efm::kernels {

/// Compares all functions of a kernel with plain code, on a small random input. Takes some
/// milliseconds.
/// @param kernel one of `availableKernels`; the plain one is compared with itself.
/// @return what differs, one line each; empty where nothing does.
std::vector<std::string> selfTest(VotingKernel kernel, std::uint32_t seed = 1);

}  // namespace efm::kernels
