// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <optional>

#include "maps/depth_metrics.h"

namespace efm {

struct EvaluateDepthArguments {
  std::filesystem::path estimate;
  std::filesystem::path truth;
  std::optional<double> focal_px;
  std::optional<double> baseline_m;
  DepthPairingOptions pairing;
  bool json = false;
};

/// `event-fusion evaluate depth`: prints the errors of depth maps against the truth.
/// @return the process's exit status.
/// @throws std::exception where something cannot be compared.
int runEvaluateDepth(const EvaluateDepthArguments& arguments);

}  // namespace efm
