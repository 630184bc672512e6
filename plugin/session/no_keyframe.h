// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include "mapping/keyframes/fusion_mapper.h"
#include "plugin/session/session_status.h"

namespace efm {

/// Says in a sentence why a finished session made no keyframe: no events, no poses, poses and
/// events that miss each other (by how much), noise alone, or too few of both for one window.
std::string whyNoKeyframe(const SessionStatus& status, const FusionMapperOptions& options);

}  // namespace efm
