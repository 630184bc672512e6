// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/recordings/open/rig_override_recording.h"

#include <utility>

#include "plugin/mrpt/pose_observation.h"
#include "plugin/recordings/calibration/calibration_file.h"

namespace efm {

RigOverrideRecording::RigOverrideRecording(std::unique_ptr<Recording> recording, RigSetup setup)
    : recording_(std::move(recording)), setup_(std::move(setup)) {}

mrpt::obs::CObservation::Ptr RigOverrideRecording::next() {
  mrpt::obs::CObservation::Ptr observation = recording_->next();
  if (!observation) {
    if (setup_.calibration && !cameras_.empty())
      setup_.calibration->requireCameras(cameras_.size());
  } else if (const auto packet = std::dynamic_pointer_cast<CObservationEvents>(observation)) {
    cameras_.insert(packet->camera_index);
    if (setup_.calibration) {
      const RigCamera camera = setup_.calibration->camera(
          static_cast<std::size_t>(packet->camera_index), knownSize(packet->camera));
      packet->camera = camera.model;
      packet->camera_pose = mrptPoseFrom(camera.T_rig_cam);
      packet->time_offset_ns = camera.time_offset_ns;
    }
  } else if (setup_.T_body_rig && poseSourceOf(*observation)) {
    setBodyToRig(*observation, *setup_.T_body_rig);
  }
  return observation;
}

}  // namespace efm
