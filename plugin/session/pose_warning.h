// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "mapping/geometry/rig.h"
#include "mapping/options/warning.h"
#include "mapping/survey/pose_check.h"

namespace efm {

/// Says what is wrong about the poses, and the option or file that would mend it.
/// @param rig with which it was found.
Warning poseWarning(const PoseFinding& finding, const Rig& rig);

}  // namespace efm
