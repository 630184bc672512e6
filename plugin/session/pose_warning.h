// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>

#include "mapping/base/text.h"
#include "mapping/geometry/rig.h"
#include "mapping/survey/depth_agreement.h"
#include "mapping/survey/pose_check.h"

namespace efm {

/// Says what is wrong about the poses, and the option or file that would mend it.
/// @param rig with which it was found.
Warning poseWarning(const PoseFinding& finding, const Rig& rig);

/// Says how the depths of the rig and those of its motion differ: `scale` or `depths-disagree`.
/// @return nothing where they agree.
std::optional<Warning> agreementWarning(const DepthAgreement& agreement);

/// Says how much the depths change with the clock and the travel of the poses: `depths-sensitive`.
/// @return nothing where 10 ms change less than the depths' standard deviation.
std::optional<Warning> sensitivityWarning(const DepthSensitivity& sensitivity);

}  // namespace efm
