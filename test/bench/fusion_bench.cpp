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

/// A plane of ray densities. Half of the voxels are empty, as in a real plane.
PlaneValues densities(std::size_t voxels, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<float> votes(-20, 20);
  PlaneValues plane(voxels);
  for (float& voxel : plane) voxel = std::max(0.0F, votes(random));
  return plane;
}

void countVoxels(benchmark::State& state, std::size_t voxels) {
  countRate(state, "voxels/s", static_cast<double>(voxels));
}

/// The mean of two inputs.
void fuseTwo(benchmark::State& state, FusionRule rule, std::size_t voxels) {
  const PlaneValues first = densities(voxels, 1);
  const PlaneValues second = densities(voxels, 2);
  FusionAccumulator accumulator(rule, 2, voxels);
  for (auto _ : state) {
    accumulator.add(first);
    accumulator.add(second);
    benchmark::DoNotOptimize(accumulator.mean().data());
    benchmark::ClobberMemory();
  }
  countVoxels(state, voxels);
}

/// All planes of a DSI.
void addPeaks(benchmark::State& state, int planes, VotingKernel kernel, std::size_t voxels) {
  constexpr unsigned kDifferent = 7;  // planes; more would not fit into the cache
  std::vector<PlaneValues> values;
  for (unsigned i = 0; i < kDifferent; ++i) values.push_back(densities(voxels, i));
  for (auto _ : state) {
    RunningPeaks peaks(voxels, kernel);
    for (int plane = 0; plane < planes; ++plane) {
      peaks.add(plane, values[static_cast<unsigned>(plane) % kDifferent]);
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
  for (const FusionRule rule : allFusionRules()) {
    session.add({"fusion", sensor.name() + "/" + std::string(nameOf(rule)), "plain"},
                [=](benchmark::State& state) { fuseTwo(state, rule, voxels); });
  }
  for (const VotingKernel kernel : availableKernels()) {
    session.add({"fusion", sensor.name() + "/peaks", std::string(nameOf(kernel))},
                [=, planes = session.plan().planes](benchmark::State& state) {
                  addPeaks(state, planes, kernel, voxels);
                });
  }
  session.run();
}

}  // namespace efm::bench
