// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/mrpt/session_feed.h"

#include "plugin/mrpt/mrpt_pose.h"
#include "plugin/mrpt/pose_observation.h"
#include "plugin/mrpt/tracker_poses.h"

namespace efm {

CameraPacket packetOf(const CObservationEvents& observation) {
  CameraPacket packet;
  packet.camera = observation.camera_index;
  packet.calibration.model = observation.camera;
  packet.calibration.T_rig_cam = rigidFrom(observation.camera_pose);
  packet.calibration.time_offset_ns = observation.time_offset_ns;
  packet.events = observation.events;
  packet.covered_until_ns = observation.covered_until_ns;
  return packet;
}

void addTo(RecordingSurveyor& surveyor, const mrpt::obs::CObservation& observation) {
  if (const auto* events = dynamic_cast<const CObservationEvents*>(&observation)) {
    surveyor.addEvents(packetOf(*events));
  } else if (const std::optional<ObservedPose> observed = poseIn(observation)) {
    const std::optional<Rigid3>& given = surveyor.setup().T_body_rig;
    surveyor.addPose({observed->t_ns, rigPose(*observed, given)}, *poseSourceOf(observation),
                     given.value_or(observed->T_body_rig));
  }
}

}  // namespace efm
