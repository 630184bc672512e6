// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <CLI/App.hpp>

#include "plugin/app/chosen_command.h"

namespace efm {

/// Adds `evaluate` with its kinds: depth, map, trajectory.
void addEvaluate(CLI::App& app, Run& run);

}  // namespace efm
