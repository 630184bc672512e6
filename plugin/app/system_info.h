// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

namespace efm {

/// Linux's "model name", or else the name of the board, which Arm processors have instead;
/// "unknown" where there is neither.
std::string processorName();

/// Prints the processor, its cores and caches, the kernels that it can run and the one that is
/// chosen, and tests each of them against the plain one.
/// @return the process's exit status: 0 if all kernels passed.
int printSystem();

}  // namespace efm
