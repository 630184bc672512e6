// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <mrpt/obs/CObservation.h>

#include "plugin/mrpt/CObservationEvents.h"
#include "plugin/session/recording_survey.h"

namespace efm {

/// The events of an observation, with their camera.
CameraPacket packetOf(const CObservationEvents& observation);

/// Adds the events or the pose of an observation to a survey: T_world_rig = T_world_body *
/// T_body_rig, with the options' T_body_rig if they have one. Ignores other observations.
/// @throws std::exception where the survey does, or where the pose is not valid.
void addTo(RecordingSurveyor& surveyor, const mrpt::obs::CObservation& observation);

}  // namespace efm
