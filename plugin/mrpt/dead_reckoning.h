// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <mrpt/obs/CActionCollection.h>
#include <mrpt/obs/CSensoryFrame.h>

#include "mapping/geometry/rigid3.h"

namespace efm {

/// The label of poses that are composed from actions; see `poseSourceOf`.
inline constexpr const char* kActionsLabel = "actions";

/// Composes the movements of actions to a pose, starting at the identity.
class DeadReckoning {
 public:
  /// Adds the mean pose change of the first CActionRobotMovement2D or 3D. Other actions have no
  /// effect.
  /// @param frame the observations after the movement. Its time is used if the movement has none.
  /// @return the pose after the movement, a CObservationRobotPose labelled "actions"; null without
  /// a movement.
  /// @throws std::invalid_argument if neither has a time.
  mrpt::obs::CObservation::Ptr poseAfter(const mrpt::obs::CActionCollection& action,
                                         const mrpt::obs::CSensoryFrame& frame);

 private:
  Rigid3 T_world_body_;
};

}  // namespace efm
