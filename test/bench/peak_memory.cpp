// SPDX-License-Identifier: BSD-3-Clause
#include "test/bench/peak_memory.h"

#include <malloc.h>

#include <fstream>
#include <string>

namespace efm::bench {
namespace {

/// A line of /proc/self/status, in MB.
std::optional<double> statusLine_mb(const std::string& key) {
  constexpr double kMbPerKib = 1024e-6;
  std::ifstream status("/proc/self/status");
  std::string word;
  while (status >> word) {
    double kib = 0;
    if (word == key + ":" && status >> kib) return kMbPerKib * kib;
  }
  return std::nullopt;
}

/// Resets the peak to the current memory.
/// @return whether it worked.
bool resetPeak() {
  std::ofstream file("/proc/self/clear_refs");
  file << "5" << std::flush;
  return file.good();
}

}  // namespace

std::optional<double> peakMemory_mb(const std::function<void()>& work) {
  malloc_trim(0);  // kept free memory would hide new memory
  if (!resetPeak()) return std::nullopt;
  const std::optional<double> before_mb = statusLine_mb("VmRSS");
  work();
  const std::optional<double> peak_mb = statusLine_mb("VmHWM");
  if (!before_mb || !peak_mb) return std::nullopt;
  return *peak_mb - *before_mb;
}

}  // namespace efm::bench
