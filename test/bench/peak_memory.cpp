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

/// @return whether the peak is now what is held at present.
bool forgetPeak() {
  std::ofstream file("/proc/self/clear_refs");
  file << "5" << std::flush;
  return file.good();
}

}  // namespace

std::optional<double> peakMemory_mb(const std::function<void()>& work) {
  malloc_trim(0);  // what was freed before and is kept would hide what is taken now
  if (!forgetPeak()) return std::nullopt;
  const std::optional<double> before_mb = statusLine_mb("VmRSS");
  work();
  const std::optional<double> peak_mb = statusLine_mb("VmHWM");
  if (!before_mb || !peak_mb) return std::nullopt;
  return *peak_mb - *before_mb;
}

}  // namespace efm::bench
