// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/recordings/open/recording_with_poses.h"

#include <algorithm>
#include <stdexcept>
#include <utility>

#include "plugin/mrpt/pose_observation.h"

namespace efm {

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

}  // namespace efm
