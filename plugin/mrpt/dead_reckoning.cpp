// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/mrpt/dead_reckoning.h"

#include <mrpt/obs/CActionRobotMovement2D.h>
#include <mrpt/obs/CActionRobotMovement3D.h>

#include <optional>
#include <stdexcept>

#include "plugin/mrpt/mrpt_pose.h"
#include "plugin/mrpt/mrpt_time.h"
#include "plugin/mrpt/pose_observation.h"

namespace efm {
namespace {

using mrpt::obs::CActionRobotMovement2D;
using mrpt::obs::CActionRobotMovement3D;

struct Movement {
  mrpt::Clock::time_point time;
  Rigid3 T_before_after;
};

std::optional<Movement> movementIn(const mrpt::obs::CActionCollection& actions) {
  for (const auto& action : actions) {
    const mrpt::obs::CAction* one = action.get_ptr().get();
    if (const auto* planar = dynamic_cast<const CActionRobotMovement2D*>(one)) {
      if (!planar->poseChange) continue;
      const mrpt::poses::CPose3D change(planar->poseChange->getMeanVal());
      return Movement{planar->timestamp, rigidFrom(change)};
    }
    if (const auto* spatial = dynamic_cast<const CActionRobotMovement3D*>(one)) {
      return Movement{spatial->timestamp, rigidFrom(spatial->poseChange.mean)};
    }
  }
  return std::nullopt;
}

mrpt::Clock::time_point timeOf(const mrpt::obs::CSensoryFrame& frame) {
  for (const auto& observation : frame) {
    if (observation->timestamp != INVALID_TIMESTAMP) return observation->timestamp;
  }
  throw std::invalid_argument(
      "a movement has no time stamp: expected one in the action or in its sensory frame");
}

}  // namespace

mrpt::obs::CObservation::Ptr DeadReckoning::poseAfter(const mrpt::obs::CActionCollection& action,
                                                      const mrpt::obs::CSensoryFrame& frame) {
  const std::optional<Movement> movement = movementIn(action);
  if (!movement) return nullptr;
  const bool timed = movement->time != INVALID_TIMESTAMP;
  const std::int64_t t_ns = nanosecondsFrom(timed ? movement->time : timeOf(frame));
  T_world_body_ = T_world_body_ * movement->T_before_after;
  return poseObservation({t_ns, T_world_body_, {}}, kActionsLabel);
}

}  // namespace efm
