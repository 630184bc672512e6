// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cstddef>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "mapping/depth/depth_extraction.h"
#include "mapping/dsi/dsi_columns.h"
#include "mapping/dsi/dsi_grid.h"
#include "mapping/dsi/plane_fusion.h"
#include "mapping/sweep/space_sweep.h"
#include "test/bench/benches.h"
#include "test/bench/synthetic_window.h"

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
void addPeaks(benchmark::State& state, VotingKernel kernel, std::size_t voxels) {
  constexpr unsigned kDifferent = 7;  // planes; more would not fit into the cache
  std::vector<PlaneValues> values;
  for (unsigned i = 0; i < kDifferent; ++i) values.push_back(densities(voxels, i));
  for (auto _ : state) {
    RunningPeaks peaks(voxels, kernel);
    for (int plane = 0; plane < kPlanes; ++plane) {
      peaks.add(plane, values[static_cast<unsigned>(plane) % kDifferent]);
    }
    benchmark::DoNotOptimize(peaks);
  }
  countVoxels(state, voxels * static_cast<std::size_t>(kPlanes));
}

}  // namespace

void addFusion(const Sensors& sensors) {
  const SensorSize& smallest = sensors.front();
  const auto voxels =
      static_cast<std::size_t>(smallest.width) * static_cast<std::size_t>(smallest.height);
  const std::string name = "fusion/" + smallest.name() + "/";
  for (const FusionRule rule : allFusionRules()) {
    add(name + std::string(nameOf(rule)) + "/plain",
        [=](benchmark::State& state) { fuseTwo(state, rule, voxels); });
  }
  for (const VotingKernel kernel : availableKernels()) {
    add(name + "peaks/" + std::string(nameOf(kernel)),
        [=](benchmark::State& state) { addPeaks(state, kernel, voxels); });
  }
  for (const SensorSize& sensor : sensors) {
    const auto swept = lazily([=] {
      const SweepInput input = makeSweepInput(makeSyntheticWindow(sensor.window(2)), kPlanes);
      return std::pair(input.planes,
                       sweepSpace(input.cameras, {input.view, input.planes}).fused.peaks);
    });
    add("extraction/" + sensor.name(), [=](benchmark::State& state) {
      const auto& [planes, peaks] = swept();
      for (auto _ : state) benchmark::DoNotOptimize(extractAsPaper(peaks, planes, {}));
      countRate(state, "pixels/s", static_cast<double>(peaks.plane.total()));
    });
  }
}

}  // namespace efm::bench
