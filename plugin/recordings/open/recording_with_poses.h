// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <exception>
#include <memory>
#include <string>
#include <vector>

#include "mapping/geometry/trajectory.h"
#include "plugin/recordings/open/recording.h"

namespace efm {

/// A recording with other poses: leaves out its own and inserts the given ones at their times, as
/// CObservationRobotPose with the label "pose".
class RecordingWithPoses : public Recording {
 public:
  /// @param poses T_world_body, in any order; poses of equal time keep their order.
  /// @param damage the error that ended the poses, thrown at the recording's end; empty: none did.
  RecordingWithPoses(std::unique_ptr<Recording> recording, std::vector<StampedPose> poses,
                     std::string damage = {});

  /// An error of the recording comes after all poses.
  mrpt::obs::CObservation::Ptr next() override;
  std::string position() const override { return position_; }
  double progress() const override { return recording_->progress(); }
  RecordingCounts counts() const override { return recording_->counts(); }

 private:
  void readAhead();

  std::unique_ptr<Recording> recording_;
  std::vector<StampedPose> poses_;  // in time order
  std::size_t next_pose_ = 0;
  std::string damage_;                  // of the poses
  mrpt::obs::CObservation::Ptr ahead_;  // the recording's next observation, if read
  bool ended_ = false;
  std::exception_ptr error_;  // the error that ended the recording
  std::string position_ = "the recording";
};

}  // namespace efm
