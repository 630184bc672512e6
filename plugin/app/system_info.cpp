// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/app/system_info.h"

#include <fmt/format.h>
#include <unistd.h>

#include <fstream>
#include <string>
#include <utility>
#include <vector>

#include "mapping/dsi/dsi_grid.h"
#include "mapping/kernels/self_test.h"
#include "mapping/sweep/space_sweep.h"

namespace efm {
namespace {

/// The sizes of the data caches, as far as the system tells them.
std::string cacheSizes() {
  std::string sizes;
  for (const auto& [name, key] : {std::pair("L1d", _SC_LEVEL1_DCACHE_SIZE),
                                  {"L2", _SC_LEVEL2_CACHE_SIZE},
                                  {"L3", _SC_LEVEL3_CACHE_SIZE}}) {
    const long bytes = sysconf(key);
    if (bytes <= 0) continue;
    sizes += fmt::format("{}{} {} KiB", sizes.empty() ? "" : ", ", name, bytes / 1024);
  }
  return sizes.empty() ? "unknown" : sizes;
}

}  // namespace

std::string processorName() {
  std::ifstream cpuinfo("/proc/cpuinfo");
  for (std::string line; std::getline(cpuinfo, line);) {
    const auto colon = line.find(": ");
    if (line.rfind("model name", 0) == 0 && colon != std::string::npos) {
      return line.substr(colon + 2);
    }
  }
  std::string board;
  std::getline(std::ifstream("/sys/firmware/devicetree/base/model"), board, '\0');
  return board.empty() ? "unknown" : board;
}

int printSystem() {
  fmt::print("event-fusion {}\nprocessor: {}\ncores: {}\ncaches: {}\n", EFM_VERSION,
             processorName(), SpaceSweepOptions().threadsOrCores(), cacheSizes());
  bool passed = true;
  for (const VotingKernel kernel : availableKernels()) {
    const std::vector<std::string> failures =
        kernels::selfTest(kernels::TestedFunctions::of(kernel));
    passed = passed && failures.empty();
    fmt::print("kernel {}: self-test {}{}\n", nameOf(kernel),
               failures.empty() ? "passed" : "FAILED",
               kernel == fastestKernel() ? ", chosen where [performance] kernel = auto" : "");
    for (const std::string& failure : failures) {
      fmt::print("  unlike plain code: {}\n", failure);
    }
  }
  return passed ? 0 : 1;
}

}  // namespace efm
