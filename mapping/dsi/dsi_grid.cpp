// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/dsi/dsi_grid.h"

#include "mapping/base/named_choice.h"

namespace efm {
namespace {

constexpr NamedChoice<VotingKernel> kKernels[] = {
    {VotingKernel::kPlain, "plain"},   {VotingKernel::kBaseline, "baseline"},
    {VotingKernel::kSse4, "sse4"},     {VotingKernel::kAvx2, "avx2"},
    {VotingKernel::kAvx512, "avx512"}, {VotingKernel::kNeon, "neon"},
};

}  // namespace

std::string_view nameOf(VotingKernel kernel) { return nameIn(kKernels, kernel); }
VotingKernel votingKernelFromName(std::string_view name) { return valueIn(kKernels, name); }

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
