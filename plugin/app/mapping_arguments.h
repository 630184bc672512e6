// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "plugin/app/command.h"

namespace efm {

void addMap(CLI::App& app, Run& run);
void addDepth(CLI::App& app, Run& run);

}  // namespace efm
