// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <benchmark/benchmark.h>

#include <cstddef>
#include <memory>
#include <string>
#include <type_traits>
#include <vector>

#include "test/bench/synthetic_window.h"

namespace efm::bench {

/// A sensor and its number of events in a window.
struct SensorSize {
  int width = 0;
  int height = 0;
  std::size_t events = 0;  ///< Events of one camera.

  std::string name() const { return std::to_string(width) + "x" + std::to_string(height); }
  SyntheticWindowOptions window(int cameras) const { return {width, height, events, cameras}; }
};

/// Sensors in order of size, the smallest first.
using Sensors = std::vector<SensorSize>;

inline constexpr int kPlanes = 100;

/// Returns a function that calls `make` when first needed: a filter may exclude its benchmarks.
template <typename Make>
auto lazily(Make make) {
  using Value = std::invoke_result_t<Make>;
  const auto made = std::make_shared<std::unique_ptr<Value>>();
  return [=]() -> Value& {
    if (!*made) made->reset(new Value(make()));
    return **made;
  };
}

/// Adds a benchmark of processor time. `run.py` compares benchmarks whose names have the same first
/// two parts.
template <typename Measure>
benchmark::internal::Benchmark* add(const std::string& name, Measure measure) {
  return benchmark::RegisterBenchmark(name.c_str(), measure)
      ->Unit(benchmark::kMillisecond)
      ->MeasureProcessCPUTime();
}

/// Sets a rate: `count` of each iteration, per second.
inline void countRate(benchmark::State& state, const char* name, double count) {
  state.counters[name] = benchmark::Counter(count, benchmark::Counter::kIsIterationInvariantRate);
}

/// Adds the votes of one camera on one thread, per kernel and sensor, and their reference.
void addVoting(const Sensors& sensors);
/// Adds whole keyframes: their stages and memory, with the default and the paper's options for
/// several motions and rigs, and their growth with each size.
void addKeyframes(const Sensors& sensors);
/// Adds the six fusion rules, the running peaks, and the depth extraction from peaks.
void addFusion(const Sensors& sensors);
/// Adds the insertion of a keyframe's cloud into small and large maps.
void addGlobalCloud(const Sensors& sensors);
/// Adds the reading of events from text, a rawlog and the file formats of sensors.
void addReading(const Sensors& sensors);
/// Adds the calls of a live host: what ends at the same millisecond, and the newest snapshot.
void addLive(const Sensors& sensors);

}  // namespace efm::bench
