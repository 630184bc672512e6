// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <mrpt/obs/CObservation.h>

#include "plugin/mrpt/CObservationEvents.h"
#include "plugin/session/mapping_session.h"

namespace efm {

/// The events of an observation, with their camera.
CameraPacket packetOf(const CObservationEvents& observation);

/// Adds the pose of an observation to a session: T_world_rig = T_world_body * T_body_rig, with the
/// options' T_body_rig if they have one. @return false for an observation without a pose.
/// @throws std::invalid_argument where the pose is not valid.
bool addPoseOf(const mrpt::obs::CObservation& observation, MappingSession& session);

}  // namespace efm
