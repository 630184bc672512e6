// SPDX-License-Identifier: BSD-3-Clause
// Runs the self-test of one kernel many times. Uses no libraries, so that it runs in an emulator.
//   self_test neon|avx2|...
#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <string>
#include <vector>

#include "test/kernels/self_test.h"

namespace {

constexpr std::array<const char*, 6> kNames = {"plain", "baseline", "sse4",
                                               "avx2",  "avx512",   "neon"};
constexpr std::uint32_t kRuns = 20;

}  // namespace

int main(int argc, char** argv) {
  const auto* const name =
      std::find(kNames.begin(), kNames.end(), std::string(argc > 1 ? argv[1] : ""));
  const auto kernel = static_cast<efm::VotingKernel>(name - kNames.begin());
  const std::vector<efm::VotingKernel> available = efm::kernels::availableKernels();
  if (std::find(available.begin(), available.end(), kernel) == available.end()) {
    std::puts("not available: the kernel that the argument names");
    return 1;
  }
  bool passed = true;
  for (std::uint32_t seed = 1; seed <= kRuns; ++seed) {
    for (const std::string& failure : efm::kernels::selfTest(kernel, seed)) {
      std::printf("%s, input %u: %s differ\n", *name, seed, failure.c_str());
      passed = false;
    }
  }
  if (passed) std::printf("%s: %u inputs passed\n", *name, kRuns);
  return passed ? 0 : 1;
}
