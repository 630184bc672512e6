// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <mrpt/obs/CActionCollection.h>
#include <mrpt/obs/CSensoryFrame.h>

#include "mapping/geometry/rigid3.h"

namespace efm {

/// The label of poses that were composed from actions; see `poseSourceOf`.
inline constexpr const char* kActionsLabel = "actions";

/// Where the movements that actions tell of lead, from the identity on.
class DeadReckoning {
 public:
  /// Adds the first movement of the action, CActionRobotMovement2D or 3D: the mean of its change of
  /// pose. Other actions do not matter.
  /// @param frame what was seen after the movement, whose time counts where that has none.
  /// @return the pose after it, CObservationRobotPose "actions"; null where nothing moved.
  /// @throws std::invalid_argument where neither has a time.
  mrpt::obs::CObservation::Ptr poseAfter(const mrpt::obs::CActionCollection& action,
                                         const mrpt::obs::CSensoryFrame& frame);

 private:
  Rigid3 T_world_body_;
};

}  // namespace efm
