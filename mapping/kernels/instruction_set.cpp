// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/kernels/instruction_set.h"

#include <cstdint>

#include "mapping/kernels/highway_targets.h"

namespace efm::kernels {
namespace {

struct Target {
  VotingKernel kernel;
  std::int64_t bits;
};

constexpr Target kTargets[] = {
    {VotingKernel::kBaseline, HWY_SCALAR | HWY_EMU128},
    {VotingKernel::kSse4, HWY_SSE4},
    {VotingKernel::kAvx2, HWY_AVX2},
    {VotingKernel::kAvx512, HWY_AVX3},
    {VotingKernel::kNeon, HWY_NEON},
};

}  // namespace

std::vector<VotingKernel> availableKernels() {
  // The compiler's own baseline always runs, even where Highway's build did not detect it.
  const std::int64_t runnable = (HWY_SUPPORTED_TARGETS | HWY_STATIC_TARGET) & HWY_TARGETS;
  std::vector<VotingKernel> kernels = {VotingKernel::kPlain};
  for (const Target& target : kTargets) {
    if ((runnable & target.bits) != 0) kernels.push_back(target.kernel);
  }
  return kernels;
}

}  // namespace efm::kernels
