// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/recordings/rig_override_recording.h"

#include <utility>

#include "plugin/mrpt/mrpt_pose.h"
#include "plugin/mrpt/pose_observation.h"

namespace efm {
namespace {

/// The same but for the rounding of MRPT's poses.
bool areNear(const Rigid3& T_a_b, const Rigid3& T_a_c) {
  constexpr double kRounding = 1e-9;
  const Rigid3 T_b_c = T_a_b.inverse() * T_a_c;
  return T_b_c.translation.norm() < kRounding && T_b_c.rotation.vec().norm() < kRounding;
}

}  // namespace

RigOverrideRecording::RigOverrideRecording(std::unique_ptr<Recording> recording, RigSetup setup)
    : recording_(std::move(recording)), setup_(std::move(setup)) {}

mrpt::obs::CObservation::Ptr RigOverrideRecording::next() {
  mrpt::obs::CObservation::Ptr observation = recording_->next();
  if (!observation) {
    if (setup_.calibration && !cameras_.empty())
      setup_.calibration->requireCameras(cameras_.size());
  } else if (const auto packet = std::dynamic_pointer_cast<CObservationEvents>(observation)) {
    cameras_.insert(packet->camera_index);
    if (setup_.calibration) recalibrate(*packet);
  } else if (setup_.T_body_rig && poseOriginOf(*observation)) {
    setBodyToRig(*observation, *setup_.T_body_rig);
  }
  return observation;
}

void RigOverrideRecording::recalibrate(CObservationEvents& packet) {
  const RigCamera camera =
      setup_.calibration->camera(static_cast<std::size_t>(packet.camera_index),
                                 CameraSize{packet.camera.width, packet.camera.height});
  if (packet.camera != camera.model || !areNear(rigidFrom(packet.camera_pose), camera.T_rig_cam)) {
    recalibrated_.insert(packet.camera_index);
  }
  packet.camera = camera.model;
  packet.camera_pose = mrptPoseFrom(camera.T_rig_cam);
}

RecordingCounts RigOverrideRecording::counts() const {
  RecordingCounts counts = recording_->counts();
  counts.recalibrated_cameras = recalibrated_.size();
  return counts;
}

}  // namespace efm
