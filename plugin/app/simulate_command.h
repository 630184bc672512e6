// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>

#include "tracking_stub/simulation_preset.h"

namespace efm {

struct SimulateArguments {
  SimulationOptions simulation;
  std::filesystem::path out;
};

/// `event-fusion simulate`: makes a recording with exact truth and writes it as a dataset folder.
/// @return the process's exit status.
/// @throws std::exception where the arguments are not valid or something cannot be written.
int runSimulate(const SimulateArguments& arguments);

}  // namespace efm
