// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "mapping/kernels/kernels.h"

namespace efm::kernels {

/// Compares the functions of a kernel with plain code on a small random input. Takes a few
/// milliseconds.
/// @param kernel one of `availableKernels`.
/// @return one line for each function that differs; empty if all agree.
std::vector<std::string> selfTest(VotingKernel kernel, std::uint32_t seed);

}  // namespace efm::kernels
