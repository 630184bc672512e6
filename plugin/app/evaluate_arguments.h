// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "plugin/app/command.h"

namespace efm {

/// Adds `evaluate` and its kinds: depth, map, trajectory.
void addEvaluate(CLI::App& app, Run& run);

}  // namespace efm
