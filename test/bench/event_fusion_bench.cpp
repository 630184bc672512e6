// SPDX-License-Identifier: BSD-3-Clause
#include <benchmark/benchmark.h>
#include <unistd.h>

#include <algorithm>
#include <exception>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "test/bench/benches.h"
#include "test/bench/machine.h"
#include "test/bench/performance_ratios.h"
#include "test/bench/performance_table.h"
#include "test/bench/program_arguments.h"

namespace {

namespace fs = std::filesystem;
using namespace efm::bench;  // NOLINT(google-build-using-namespace)

constexpr const char* kUsage =
    "usage: event_fusion_bench [--quick] [--out DIR] [--commit TEXT] [GROUP ...] "
    "[--benchmark_...]\n"
    "Runs the groups (all of them: voting keyframe motion fusion extraction global_cloud reading "
    "growth)\n"
    "and writes DIR/performance.csv and DIR/performance.md.\n";

struct Group {
  const char* name;
  void (*run)(BenchSession&);
};

constexpr Group kGroups[] = {{"voting", benchVoting},         {"keyframe", benchKeyframes},
                             {"motion", benchMotions},        {"fusion", benchFusion},
                             {"extraction", benchExtraction}, {"global_cloud", benchGlobalCloud},
                             {"reading", benchReading},       {"growth", benchGrowth}};

/// The members of a batch run in turns, unless an option changes this.
void initializeBenchmark(std::string program, std::vector<std::string> words) {
  words.insert(words.begin(), "--benchmark_enable_random_interleaving=true");
  words.insert(words.begin(), std::move(program));
  std::vector<char*> argv;
  for (std::string& word : words) argv.push_back(word.data());
  auto argc = static_cast<int>(argv.size());
  benchmark::Initialize(&argc, argv.data());
  if (benchmark::ReportUnrecognizedArguments(argc, argv.data())) {
    throw std::invalid_argument(kUsage);
  }
}

/// A folder that exists as long as this object.
class ScratchFolder {
 public:
  ScratchFolder()
      : path_(fs::temp_directory_path() / ("event_fusion_bench." + std::to_string(getpid()))) {
    fs::create_directories(path_);
  }
  ~ScratchFolder() {
    std::error_code ignored;
    fs::remove_all(path_, ignored);
  }
  ScratchFolder(const ScratchFolder&) = delete;
  ScratchFolder& operator=(const ScratchFolder&) = delete;
  const fs::path& path() const { return path_; }

 private:
  fs::path path_;
};

template <typename Write>
void writeFile(const fs::path& file, Write write, const std::vector<PerformanceRow>& rows,
               const Conditions& conditions) {
  std::ofstream stream(file);
  write(stream, rows, conditions);
  stream.close();
  if (!stream) throw std::runtime_error(file.string() + ": cannot be written");
  std::cout << "written to " << file.string() << '\n';
}

void run(const ProgramArguments& arguments) {
  const fs::path out = arguments.value("--out");
  if (!out.empty()) fs::create_directories(out);
  Conditions conditions = describeMachine();
  conditions.emplace_back("commit", arguments.value("--commit", "unknown"));
  conditions.emplace_back("load before", loadAverage());

  const ScratchFolder scratch;
  BenchPlan plan = arguments.quick ? BenchPlan::quick() : BenchPlan::full();
  plan.scratch = scratch.path();
  BenchSession session(plan);
  for (const Group& group : kGroups) {
    if (arguments.includes(group.name)) group.run(session);
  }
  conditions.emplace_back("load after", loadAverage());

  std::vector<PerformanceRow> rows = session.rows();
  addRatios(rows);
  addExponents(rows);
  for (const PerformanceRow& row : rows) {
    for (const Quantity& quantity : row.quantities) {
      const bool derived = quantity.name == "exponent" || quantity.name.rfind("times_", 0) == 0;
      if (!derived) continue;
      std::cout << row.group << '/' << row.name << ' ' << row.kernel << ' ' << row.threads
                << (row.threads == 1 ? " thread: " : " threads: ") << quantity.name << ' '
                << quantity.value << '\n';
    }
  }
  if (out.empty()) return;
  writeFile(out / "performance.csv", writeCsv, rows, conditions);
  writeFile(out / "performance.md", writeMarkdown, rows, conditions);
}

}  // namespace

int main(int argc, char** argv) {
  try {
    ArgumentRules rules{{"--out", "--commit"}, {}, kUsage};
    for (const Group& group : kGroups) rules.names.emplace_back(group.name);
    std::vector<std::string> words(argv + 1, argv + argc);
    const auto ours = std::stable_partition(words.begin(), words.end(), [](const auto& word) {
      return word.rfind("--benchmark_", 0) != 0;
    });
    initializeBenchmark(argv[0], {ours, words.end()});
    run(readArguments({words.begin(), ours}, rules));
    return 0;
  } catch (const std::exception& error) {
    std::cerr << "event_fusion_bench: " << error.what() << '\n';
    return 1;
  }
}
