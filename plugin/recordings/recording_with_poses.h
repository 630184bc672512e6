// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <exception>
#include <memory>
#include <string>
#include <vector>

#include "mapping/geometry/trajectory.h"
#include "plugin/recordings/recording.h"

namespace efm {

/// A recording with poses of its own choice: those it has are left out, the given ones put in at
/// their times, as CObservationRobotPose "pose".
class RecordingWithPoses : public Recording {
 public:
  /// @param poses T_world_body, in any order; those of equal time keep theirs.
  RecordingWithPoses(std::unique_ptr<Recording> recording, std::vector<StampedPose> poses);

  /// Where the recording cannot be read on, its error comes when the poses were given.
  mrpt::obs::CObservation::Ptr next() override;
  std::string place() const override { return place_; }
  double progress() const override { return recording_->progress(); }
  RecordingCounts counts() const override { return recording_->counts(); }

 private:
  void readAhead();

  std::unique_ptr<Recording> recording_;
  std::vector<StampedPose> poses_;  // in time order
  std::size_t next_pose_ = 0;
  mrpt::obs::CObservation::Ptr ahead_;  // the recording's next one, where it was read already
  bool ended_ = false;
  std::exception_ptr error_;  // that ended it
  std::string place_ = "the recording";
};

}  // namespace efm
