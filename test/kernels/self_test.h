// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "mapping/kernels/kernels.h"

namespace efm::kernels {

/// Compares the functions of a kernel with plain code, on a small random input. Takes some
/// milliseconds.
/// @param kernel one of `availableKernels`.
/// @return what differs, one line each; empty if nothing does.
std::vector<std::string> selfTest(VotingKernel kernel, std::uint32_t seed);

}  // namespace efm::kernels
