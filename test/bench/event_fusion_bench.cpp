// SPDX-License-Identifier: BSD-3-Clause
// The benchmarks of the library. `run.py` runs them and writes the tables of docs/performance.md.
//   event_fusion_bench [--small] [--benchmark_...]
// --small   small windows: tests that everything runs
#include <benchmark/benchmark.h>

#include <string>

#include "plugin/app/commands.h"
#include "test/bench/benches.h"

int main(int argc, char** argv) {
  benchmark::Initialize(&argc, argv);
  const bool small = argc == 2 && argv[1] == std::string("--small");
  if (!small && benchmark::ReportUnrecognizedArguments(argc, argv)) return 1;
  benchmark::AddCustomContext("processor", efm::processorName());
  benchmark::AddCustomContext("compiler", EFM_COMPILER);
  benchmark::AddCustomContext("flags", EFM_COMPILER_FLAGS);
  const efm::bench::Sensors sensors =
      small
          ? efm::bench::Sensors{{86, 65, 5'000}}
          : efm::bench::Sensors{{346, 260, 235'000}, {640, 480, 2'000'000}, {1280, 720, 5'000'000}};
  efm::bench::addVoting(sensors);
  efm::bench::addKeyframes(sensors);
  efm::bench::addFusion(sensors);
  efm::bench::addGlobalCloud(sensors);
  efm::bench::addReading(sensors);
  efm::bench::addLive(sensors);
  benchmark::RunSpecifiedBenchmarks();
  return 0;
}
