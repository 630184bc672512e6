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

/// What one benchmark measures.
struct BenchCase {
  std::string group;
  std::string name;
  std::string kernel;  ///< Empty where none runs.
  int threads = 1;
};

/// A case and the name of its benchmark.
struct NamedCase {
  std::string name;
  BenchCase what;
};

/// Runs benchmarks in batches whose members are compared with each other: their repetitions take
/// turns, so that what else the machine does meets all of them alike. Keeps the
/// medians, in the order in which the cases were added.
class BenchSession {
 public:
  explicit BenchSession(BenchPlan plan) : plan_(std::move(plan)) {}

  const BenchPlan& plan() const { return plan_; }

  /// Adds to the batch. Its counters become quantities of the case.
  void add(const BenchCase& what, const std::function<void(benchmark::State&)>& benchmark);
  /// Runs the batch and prints a line for each case. What the benchmarks refer to may go after it.
  void run();

  const std::vector<PerformanceRow>& rows() const { return rows_; }

 private:
  BenchPlan plan_;
  std::vector<NamedCase> batch_;
  std::vector<PerformanceRow> rows_;
};

}  // namespace efm::bench
