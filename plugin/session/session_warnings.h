// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "plugin/session/health_checks.h"
#include "plugin/session/session_status.h"

namespace efm {

/// What a finished session did not use, and where its map has holes.
std::vector<Warning> sessionWarnings(const SessionStatus& status,
                                     const FusionMapperOptions& options);

/// Automatic options were chosen without a scene.
Warning noSceneWarning();

}  // namespace efm
