// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "mapping/space_sweep.h"

namespace efm::bench {

/// The kernels that this processor can run, the plain one first and the fastest last.
inline std::vector<VotingKernel> kernelsToMeasure() { return {VotingKernel::kPlain}; }

}  // namespace efm::bench
