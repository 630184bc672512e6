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
#include "mapping/kernels/kernels.h"
#include "mapping/rays/rays.h"
#include "mapping/sweep/ray_bins.h"
#include "mapping/sweep/space_sweep.h"
#include "mapping/sweep/tiles.h"
#include "test/bench/benches.h"
#include "test/bench/synthetic_window.h"

namespace efm::bench {
namespace {

/// Draws a plane of ray densities. Half of the voxels are empty, as in a real plane.
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

/// Measures the mean of two inputs.
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

/// Measures the running peaks over all planes of a DSI.
void addPeaks(benchmark::State& state, VotingKernel kernel, std::size_t voxels) {
  constexpr unsigned kDifferent = 7;  // different planes; more do not fit into the cache
  std::vector<PlaneValues> values;
  for (unsigned i = 0; i < kDifferent; ++i) values.push_back(densities(voxels, i));
  for (auto _ : state) {
    RunningPeaks peaks(voxels, kernel);
    for (int plane = 0; plane < kPlanes; ++plane) {
      peaks.add(plane, values[static_cast<unsigned>(plane) % kDifferent].data());
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

namespace {

const RayBundle& raysOf(const SweepInput& input) { return input.cameras.front().front(); }

void countVotes(benchmark::State& state, const SweepInput& input) {
  const auto events = static_cast<double>(raysOf(input).size());
  const double votes = events * input.planes.size();
  countRate(state, "events/s", events);
  countRate(state, "votes/s", votes);
  state.counters["packets"] = static_cast<double>(raysOf(input).packets.size());
}

/// Measures the reference of the ratios: the plain kernel on one plane that is cleared for each
/// depth. The transfers of the rays are computed before the measurement.
void voteYardstick(benchmark::State& state, const SweepInput& input) {
  const RayBundle& rays = raysOf(input);
  std::vector<std::vector<kernels::RayTransfer>> transfers;  // per plane
  for (int plane = 0; plane < input.planes.size(); ++plane) {
    auto& of_plane = transfers.emplace_back();
    for (const RayPacket& packet : rays.packets) {
      const PlaneTransfer to = transferToPlane(packet, input.view, input.planes.depth(plane));
      if (!to.in_front) continue;
      of_plane.push_back({packet.begin, packet.end, static_cast<float>(to.scale),
                          static_cast<float>(to.offset_x), static_cast<float>(to.offset_y)});
    }
  }
  std::vector<float> votes(input.view.pixels());
  for (auto _ : state) {
    for (const auto& of_plane : transfers) {
      std::fill(votes.begin(), votes.end(), 0.0F);
      for (const kernels::RayTransfer& transfer : of_plane) {
        benchmark::DoNotOptimize(
            kernels::voteBilinear({rays.x_inf.data(), rays.y_inf.data()}, transfer,
                                  {votes.data(), input.view.width, input.view.height}));
      }
      benchmark::ClobberMemory();
    }
  }
  countVotes(state, input);
}

/// Measures the votes of the fast kernels, up to the ray density of every plane. As for the
/// reference, the rays are prepared before the measurement: they are in bins.
void voteTiles(benchmark::State& state, const SweepInput& input, VotingKernel kernel) {
  const RayIndex rays(input.cameras, {input.view, input.planes}, kernel);
  TileAccumulator accumulator(kernel);
  TileRays gathered;
  std::vector<float> density(TileCells::kMaxPixels * TileCells::kMaxPixels);
  const std::vector<cv::Rect> tiles = tilesOf(input.view, TileCells::kMaxPixels);
  for (auto _ : state) {
    for (std::size_t g = 0; g < rays.groups().size(); ++g) {
      const PlaneRange& group = rays.groups()[g];
      for (const cv::Rect& tile : tiles) {
        const TileCells cells(tile, input.view);
        accumulator.moveTo(cells);
        rays.gather(g, 0, cells, gathered);
        for (int plane = group.begin; plane < group.end; ++plane) {
          rays.gatherOn(plane, g, 0, cells, gathered);
          accumulator.vote(gathered, rays.fromPixels(plane));
          benchmark::DoNotOptimize(accumulator.resolve(density.data()));
          benchmark::ClobberMemory();
        }
      }
    }
  }
  countVotes(state, input);
}

void sweep(benchmark::State& state, const SweepInput& input, VotingKernel kernel) {
  SpaceSweepOptions options;
  options.threads = 1;
  options.kernel = kernel;
  for (auto _ : state) {
    state.PauseTiming();
    std::vector<CameraRays> cameras = input.cameras;  // the sweep consumes them
    state.ResumeTiming();
    benchmark::DoNotOptimize(sweepSpace(std::move(cameras), {input.view, input.planes}, options));
  }
  countVotes(state, input);
}

}  // namespace

void addVoting(const Sensors& sensors) {
  for (const SensorSize& sensor : sensors) {
    const auto input =
        lazily([=] { return makeSweepInput(makeSyntheticWindow(sensor.window(1)), kPlanes); });
    const std::string name = "voting/" + sensor.name();
    add(name + "/densities/yardstick",
        [=](benchmark::State& state) { voteYardstick(state, input()); });
    for (const VotingKernel kernel : availableKernels()) {
      if (kernel == VotingKernel::kPlain) continue;  // the yardstick
      add(name + "/densities/" + std::string(nameOf(kernel)),
          [=](benchmark::State& state) { voteTiles(state, input(), kernel); });
    }
    for (const VotingKernel kernel : availableKernels()) {
      add(name + "/sweep/" + std::string(nameOf(kernel)),
          [=](benchmark::State& state) { sweep(state, input(), kernel); });
    }
  }
}

}  // namespace efm::bench
