// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <vector>

#include "mapping/geometry/trajectory.h"

namespace efm {

/// The direction up, estimated from the keyframes' cameras: across their x axes, which lie level in
/// most recordings, and near their mean -y. Within 15 degrees of an axis of the world it is that
/// axis. z where there is no keyframe or the cameras looked in all directions.
/// @param trajectory T_world_ref of the keyframes.
/// @return a unit vector, frame `world`.
Eigen::Vector3d upwardOf(const std::vector<StampedPose>& trajectory);

}  // namespace efm
