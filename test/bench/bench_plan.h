// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "test/bench/synthetic_window.h"

namespace efm::bench {

/// A sensor and its number of events in a window.
struct SensorSize {
  int width = 0;
  int height = 0;
  std::size_t events = 0;  ///< Per camera.

  std::string name() const { return std::to_string(width) + "x" + std::to_string(height); }
  SyntheticWindowOptions window(int cameras) const;
};

/// The size of a run.
struct BenchPlan {
  std::vector<SensorSize> sensors;  ///< The smallest first.
  int planes = 100;
  std::vector<std::uint64_t> map_points;  ///< Numbers of points of the global clouds.
  int growth_steps = 5;                   ///< Number of sizes per growth.
  bool once = false;  ///< Run each case once; else the median of `repetitions` counts.
  int repetitions = 5;
  std::filesystem::path scratch;  ///< Folder for temporary files.

  /// For the figures of the project. Takes some minutes.
  static BenchPlan full();
  /// Tests that everything runs. Its times mean nothing. Takes seconds.
  static BenchPlan quick();
};

}  // namespace efm::bench
