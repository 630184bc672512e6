// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "test/bench/synthetic_window.h"

namespace efm::bench {

/// A sensor and what it sees in one window.
struct SensorSize {
  int width = 0;
  int height = 0;
  std::size_t events = 0;  ///< Per camera.

  std::string name() const { return std::to_string(width) + "x" + std::to_string(height); }
  SyntheticWindowOptions window(int cameras) const;
};

/// How large a run is.
struct BenchPlan {
  std::vector<SensorSize> sensors;  ///< The smallest first.
  int planes = 100;
  std::vector<std::uint64_t> map_points;  ///< Sizes of the global cloud that is inserted into.
  int growth_steps = 5;                   ///< Sizes of each thing that a keyframe grows with.
  bool once = false;  ///< Each case runs a single time; otherwise the median of `repetitions`.
  int repetitions = 5;
  std::filesystem::path scratch;  ///< A folder for files that are written to be read.

  /// What the figures of the project are measured with. Some minutes.
  static BenchPlan full();
  /// Shows that everything runs; its times mean nothing. Seconds.
  static BenchPlan quick();
};

}  // namespace efm::bench
