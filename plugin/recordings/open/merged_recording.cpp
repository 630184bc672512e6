// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/recordings/open/merged_recording.h"

#include <algorithm>
#include <stdexcept>

#include "mapping/base/named_choice.h"
#include "mapping/geometry/timestamp.h"
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

RecordingWithPoses::RecordingWithPoses(std::unique_ptr<Recording> recording,
                                       std::vector<StampedPose> poses, std::string damage)
    : recording_(std::move(recording)), poses_(std::move(poses)), damage_(std::move(damage)) {
  std::stable_sort(poses_.begin(), poses_.end(),
                   [](const StampedPose& a, const StampedPose& b) { return a.t_ns < b.t_ns; });
}

mrpt::obs::CObservation::Ptr RecordingWithPoses::next() {
  readAhead();
  const bool poses_left = next_pose_ < poses_.size();
  if (poses_left && (ended_ || mrptTimeFrom(poses_[next_pose_].t_ns) <= ahead_->timestamp)) {
    position_ = "the poses";
    const StampedPose& pose = poses_[next_pose_++];
    return poseObservation({pose.t_ns, pose.T_world_rig, {}}, "pose");
  }
  if (error_) std::rethrow_exception(error_);
  if (ended_ && !damage_.empty()) throw std::runtime_error(damage_);
  if (ended_) return nullptr;
  position_ = recording_->position();
  return std::exchange(ahead_, nullptr);
}

void RecordingWithPoses::readAhead() {
  while (!ahead_ && !ended_) {
    try {
      ahead_ = recording_->next();
    } catch (const std::exception&) {
      error_ = std::current_exception();
    }
    ended_ = ahead_ == nullptr;
    if (ahead_ && poseSourceOf(*ahead_)) ahead_ = nullptr;
  }
}

MergedRecording::MergedRecording(Rig rig, std::vector<EventPackets> cameras,
                                 std::uint64_t skip_bad_events)
    : rig_(std::move(rig)),
      bad_(std::make_unique<BadEvents>(skip_bad_events)),
      cameras_(std::move(cameras)) {
  for (EventPackets& camera : cameras_) camera.skipBadEvents(*bad_);
  requireOption(cameras_.size() == rig_.cameras.size(), "event streams", cameras_.size(),
                "one per camera");
}

void MergedRecording::requireEvents() {
  if (cameras_.empty() || nextCamera()) return;
  std::string names;
  for (const EventPackets& camera : cameras_) {
    names += (names.empty() ? "" : ", ") + camera.stream().name();
  }
  throw std::runtime_error(names + ": no events: expected at least one");
}

mrpt::obs::CObservation::Ptr MergedRecording::next() {
  const std::optional<std::size_t> camera = nextCamera();
  if (!camera) return nullptr;
  position_ = cameras_[*camera].stream().name();
  const std::int64_t t_ns = *cameras_[*camera].nextTime();
  if (announced_ < cameras_.size()) return packetOf(announced_++, t_ns, {});
  return packetOf(*camera, t_ns, cameras_[*camera].nextPacket());
}

/// The camera with the earliest next packet; of several the first one.
std::optional<std::size_t> MergedRecording::nextCamera() {
  std::optional<std::size_t> first;
  std::int64_t first_ns = kEndOfTimeNs;
  for (std::size_t camera = 0; camera < cameras_.size(); ++camera) {
    const std::int64_t t_ns = cameras_[camera].nextTime().value_or(kEndOfTimeNs);
    if (t_ns >= first_ns) continue;
    first_ns = t_ns;
    first = camera;
  }
  return first;
}

mrpt::obs::CObservation::Ptr MergedRecording::packetOf(std::size_t camera, std::int64_t t_ns,
                                                       std::vector<Event> events) {
  auto packet = CObservationEvents::Create();
  packet->sensorLabel = "cam" + std::to_string(camera);
  packet->timestamp = mrptTimeFrom(t_ns);
  packet->camera_index = static_cast<int>(camera);
  packet->camera = rig_.cameras[camera].model;
  packet->camera_pose = mrptPoseFrom(rig_.cameras[camera].T_rig_cam);
  packet->time_offset_ns = rig_.cameras[camera].time_offset_ns;
  packet->events = std::move(events);
  if (nextCamera()) {
    packet->covered_until_ns = cameras_[camera].nextTime().value_or(kEndOfTimeNs);
  }
  return packet;
}

double MergedRecording::progress() const {
  double least = 1;
  for (const EventPackets& camera : cameras_) {
    least = std::min(least, camera.stream().progress());
  }
  return least;
}

RecordingCounts MergedRecording::counts() const {
  RecordingCounts counts;
  counts.warnings = warnings_;
  counts.skipped_events = bad_->count();
  counts.first_skipped = bad_->first();
  for (const EventPackets& camera : cameras_) {
    counts.sorted_events += camera.sortedEvents();
    counts.lost_packets += camera.stream().lostPackets();
    counts.undated_events += camera.stream().undatedEvents();
    for (Warning& warning : camera.stream().warnings()) {
      counts.warnings.push_back(std::move(warning));
    }
  }
  return counts;
}

}  // namespace efm
