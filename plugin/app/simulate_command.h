// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>

#include "plugin/app/progress.h"
#include "tracking_stub/sensor/simulated_rig.h"

namespace efm {

struct SimulateArguments {
  std::string preset;  ///< Empty: `scene`, `trajectory` and `calibration` are used.
  std::string scene;
  std::filesystem::path trajectory;   ///< TUM, T_world_cam0.
  std::filesystem::path calibration;  ///< Kalibr camera chain.
  std::optional<std::int64_t> start_ns;
  std::optional<double> duration_s;
  std::uint64_t seed = 1;
  // Default: the preset's pixels, or ideal ones.
  std::optional<double> threshold_on;
  std::optional<double> threshold_off;
  double mismatch = 0;
  double refractory_us = 0;
  EventNoiseOptions noise;
  std::filesystem::path out;
  Verbosity verbosity = Verbosity::kNormal;
};

/// `event-fusion simulate`: simulates a recording with exact truth and writes it as a dataset
/// folder.
/// @return the process's exit status.
/// @throws Interrupted if a signal came; then there is no result.
/// @throws std::exception if the arguments are not valid or something cannot be written.
int runSimulate(const SimulateArguments& arguments);

}  // namespace efm
