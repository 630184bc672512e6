// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "tracking_stub/sensor/simulated_rig.h"

namespace efm {

struct SimulationOptions {
  std::string preset = "desk_stereo";  ///< One of `simulationPresets`.
  /// Seconds, 0.001 to 600. Default: the preset's duration.
  std::optional<double> duration_s;
  /// Seed of everything random: the paintings and the initial memory of the pixels.
  std::uint64_t seed = 1;

  /// @throws std::invalid_argument naming the field, its value and the allowed values.
  void validate() const;
};

std::vector<std::string> simulationPresets();

/// Scene, rig and motion of a preset.
/// @throws std::invalid_argument where the options are not valid.
Simulation makeSimulation(const SimulationOptions& options = {});

}  // namespace efm
