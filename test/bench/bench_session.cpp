// SPDX-License-Identifier: BSD-3-Clause
#include "test/bench/bench_session.h"

#include <map>
#include <utility>

namespace efm::bench {
namespace {

constexpr double kMinTime_s = 0.2;

std::string benchmarkName(const BenchCase& what) {
  std::string name = what.group + "/" + what.name;
  if (!what.kernel.empty()) name += "/" + what.kernel;
  if (what.threads != 1) name += "/threads:" + std::to_string(what.threads);
  return name;
}

/// Prints the medians over the repetitions and keeps them; a single run is its own median.
class MedianReporter : public benchmark::ConsoleReporter {
 public:
  MedianReporter() : ConsoleReporter(OO_Tabular) {}

  /// The machine stands in the table, once for all batches.
  bool ReportContext(const Context& context) override {
    name_field_width_ = context.name_field_width;
    printed_header_ = false;
    return true;
  }

  void ReportRuns(const std::vector<Run>& runs) override {
    std::vector<Run> medians;
    for (const Run& run : runs) {
      auto& quantities = quantities_[run.run_name.function_name];
      const bool single = run.run_type == Run::RT_Iteration && run.repetitions <= 1;
      if (single || run.aggregate_name == "median") {
        medians.push_back(run);
        quantities.push_back({"cpu_ms", run.GetAdjustedCPUTime()});
        quantities.push_back({"real_ms", run.GetAdjustedRealTime()});
        for (const auto& [name, counter] : run.counters) quantities.push_back({name, counter});
      } else if (run.aggregate_name == "cv") {
        quantities.push_back({"cpu_cv", run.cpu_accumulated_time});
      }
    }
    if (!medians.empty()) ConsoleReporter::ReportRuns(medians);
  }

  std::vector<Quantity> quantitiesOf(const std::string& name) { return quantities_[name]; }

 private:
  std::map<std::string, std::vector<Quantity>> quantities_;  // by the benchmark's name
};

}  // namespace

void BenchSession::add(const BenchCase& what,
                       const std::function<void(benchmark::State&)>& benchmark) {
  const NamedCase& added = batch_.emplace_back(NamedCase{benchmarkName(what), what});
  auto* const registered = benchmark::RegisterBenchmark(added.name.c_str(), benchmark);
  registered->Unit(benchmark::kMillisecond)->MeasureProcessCPUTime();
  if (plan_.once) {
    registered->Iterations(1);
  } else {
    registered->MinTime(kMinTime_s)->Repetitions(plan_.repetitions);
  }
}

void BenchSession::run() {
  MedianReporter reporter;
  benchmark::RunSpecifiedBenchmarks(&reporter);
  benchmark::ClearRegisteredBenchmarks();
  for (const auto& [name, what] : batch_) {
    std::vector<Quantity> quantities = reporter.quantitiesOf(name);
    if (quantities.empty()) continue;  // a filter left it out
    rows_.push_back({what.group, what.name, what.kernel, what.threads, std::move(quantities)});
  }
  batch_.clear();
}

}  // namespace efm::bench
