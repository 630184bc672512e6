// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <benchmark/benchmark.h>

#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "test/bench/bench_plan.h"
#include "test/bench/performance_row.h"

namespace efm::bench {

/// Sets a rate: `count` of each iteration, per second.
inline void countRate(benchmark::State& state, const char* name, double count) {
  state.counters[name] = benchmark::Counter(count, benchmark::Counter::kIsIterationInvariantRate);
}

/// The case that a benchmark measures.
struct BenchCase {
  std::string group;
  std::string name;
  std::string kernel;  ///< Empty without a kernel.
  int threads = 1;
};

/// A case and the name of its benchmark.
struct NamedCase {
  std::string name;
  BenchCase what;
};

/// Runs benchmarks in batches. The members of a batch are compared: their repetitions take turns,
/// so other load of the machine affects all of them equally. Keeps the medians, in the order of
/// `add`.
class BenchSession {
 public:
  explicit BenchSession(BenchPlan plan) : plan_(std::move(plan)) {}

  const BenchPlan& plan() const { return plan_; }

  /// Adds a benchmark to the batch. Its counters become quantities of the case.
  void add(const BenchCase& what, const std::function<void(benchmark::State&)>& benchmark);
  /// Runs the batch and prints a line for each case. The benchmarks are not called after it.
  void run();

  const std::vector<PerformanceRow>& rows() const { return rows_; }

 private:
  BenchPlan plan_;
  std::vector<NamedCase> batch_;
  std::vector<PerformanceRow> rows_;
};

}  // namespace efm::bench
