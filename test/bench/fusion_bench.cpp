// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cstddef>
#include <random>
#include <string>
#include <vector>

#include "mapping/dsi/dsi_peaks.h"
#include "mapping/dsi/fusion_rule.h"
#include "mapping/dsi/plane_values.h"
#include "mapping/dsi/voting_kernel.h"
#include "test/bench/benches.h"

namespace efm::bench {
namespace {

/// A plane of ray densities; as in a real one half of the voxels are empty.
PlaneValues densities(std::size_t voxels, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<float> votes(-20, 20);
  PlaneValues plane(voxels);
  for (float& voxel : plane) voxel = std::max(0.0F, votes(random));
  return plane;
}

void countVoxels(benchmark::State& state, std::size_t voxels) {
  state.counters["voxels/s"] = benchmark::Counter(static_cast<double>(voxels),
                                                  benchmark::Counter::kIsIterationInvariantRate);
}

/// The mean of two inputs.
void fuseTwo(benchmark::State& state, FusionRule rule, VotingKernel kernel, std::size_t voxels) {
  const PlaneValues first = densities(voxels, 1);
  const PlaneValues second = densities(voxels, 2);
  FusionAccumulator accumulator(rule, voxels, kernel);
  for (auto _ : state) {
    accumulator.begin(2);
    accumulator.fold(first.data());
    accumulator.fold(second.data());
    accumulator.finish();
    benchmark::DoNotOptimize(accumulator.values().data());
    benchmark::ClobberMemory();
  }
  countVoxels(state, voxels);
}

/// All planes of a DSI.
void takePeaks(benchmark::State& state, int planes, VotingKernel kernel, std::size_t voxels) {
  constexpr unsigned kDifferent = 7;  // planes; more would not fit the cache that the sweep's do
  std::vector<PlaneValues> values;
  for (unsigned i = 0; i < kDifferent; ++i) values.push_back(densities(voxels, i));
  for (auto _ : state) {
    RunningPeaks peaks(voxels, kernel);
    for (int plane = 0; plane < planes; ++plane) {
      peaks.take(plane, values[static_cast<unsigned>(plane) % kDifferent]);
    }
    benchmark::DoNotOptimize(peaks);
  }
  countVoxels(state, voxels * static_cast<std::size_t>(planes));
}

}  // namespace

void benchFusion(BenchSession& session) {
  const SensorSize& sensor = session.plan().sensors.front();
  const std::size_t voxels =
      static_cast<std::size_t>(sensor.width) * static_cast<std::size_t>(sensor.height);
  for (const VotingKernel kernel : availableKernels()) {
    const std::string kernel_name(nameOf(kernel));
    for (const FusionRule rule : allFusionRules()) {
      session.add({"fusion", sensor.name() + "/" + std::string(nameOf(rule)), kernel_name},
                  [=](benchmark::State& state) { fuseTwo(state, rule, kernel, voxels); });
    }
    session.add({"fusion", sensor.name() + "/peaks", kernel_name},
                [=, planes = session.plan().planes](benchmark::State& state) {
                  takePeaks(state, planes, kernel, voxels);
                });
  }
  session.run();
}

}  // namespace efm::bench
