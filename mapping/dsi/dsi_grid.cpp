// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/dsi/dsi_grid.h"

namespace efm {

const std::vector<VotingKernel>& availableKernels() {
  static const std::vector<VotingKernel> kernels = kernels::availableKernels();
  return kernels;
}

bool isAvailable(VotingKernel kernel) {
  const auto& all = availableKernels();
  return std::find(all.begin(), all.end(), kernel) != all.end();
}

VotingKernel fastestOf(const std::vector<VotingKernel>& kernels) {
  VotingKernel fastest = VotingKernel::kPlain;
  for (const VotingKernel kernel : kernels) {
    if (kernel != VotingKernel::kBaseline) fastest = std::max(fastest, kernel);
  }
  return fastest;
}

VotingKernel fastestKernel() { return fastestOf(availableKernels()); }

}  // namespace efm
