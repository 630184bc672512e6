// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "plugin/app/command.h"

namespace efm {

void addSimulate(CLI::App& app, Run& run);

}  // namespace efm
