// SPDX-License-Identifier: BSD-3-Clause
#include "test/bench/machine.h"

#include <benchmark/benchmark.h>

#include <fstream>

#include "plugin/app/system_info.h"

namespace efm::bench {
namespace {

std::string cacheSize(int level) {
  for (const auto& cache : benchmark::CPUInfo::Get().caches) {
    if (cache.level != level || cache.type == "Instruction") continue;
    return std::to_string(cache.size / 1024) + " KiB";
  }
  return "unknown";
}

}  // namespace

Conditions describeMachine() {
  return {
      {"processor", processorName()}, {"cores", std::to_string(benchmark::CPUInfo::Get().num_cpus)},
      {"L1d", cacheSize(1)},          {"L2", cacheSize(2)},
      {"compiler", EFM_COMPILER},     {"flags", EFM_COMPILER_FLAGS}};
}

std::string loadAverage() {
  std::string load = "unknown";
  std::ifstream("/proc/loadavg") >> load;
  return load;
}

}  // namespace efm::bench
