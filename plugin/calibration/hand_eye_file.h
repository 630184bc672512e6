// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>

#include "mapping/geometry/rigid3.h"

namespace efm {

/// Reads the rig's pose on the tracked body, from YAML with the one key
///   T_body_rig   4x4, from the rig's frame to the body's:
/// T_world_rig = T_world_body * T_body_rig. Other keys are ignored. Its rotation may be off by
/// 1e-3, because of rounding; the nearest rotation is taken.
/// @throws std::runtime_error naming the file, the key, the value and what was expected.
Rigid3 readHandEye(const std::filesystem::path& file);

}  // namespace efm
