// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <deque>
#include <exception>
#include <map>
#include <memory>
#include <optional>
#include <string>

#include "plugin/recordings/open/merged_recording.h"
#include "plugin/session/pose_source_selector.h"
#include "tracking_stub/faults/tracker_faults.h"

namespace efm {

/// A recording whose trackers have faults: its CObservationRobotPose are lost, wrong and late, each
/// source's with the same random draws. Other observations stay as they are, odometry and the
/// poses of actions too. Of a pose's observation the mean alone changes. A jump is marked by
/// copies of a pose with times of their own, one of MRPT's ticks apart.
///
/// Without latency, poses come before the packets that begin at their time or later. With latency,
/// a pose comes behind the pose that is newer by the latency. With noise per keyframe, the
/// recording is read ahead by the largest gap between poses.
class PerturbedRecording : public Recording {
 public:
  /// @param faults their tick is replaced by MRPT's.
  PerturbedRecording(std::unique_ptr<Recording> recording, const TrackerFaults& faults);
  ~PerturbedRecording() override;

  /// An error of the recording comes after the observations before it.
  /// @throws std::invalid_argument where a pose has no time, or is older than the pose before it.
  mrpt::obs::CObservation::Ptr next() override;
  std::string position() const override { return position_; }
  double progress() const override { return recording_->progress(); }
  RecordingCounts counts() const override { return recording_->counts(); }

 private:
  class Tracker;
  struct Entry {
    mrpt::obs::CObservation::Ptr observation;
    std::optional<std::int64_t> t_ns;
    std::string position;
  };

  void readOne();
  void take(const mrpt::obs::CObservation::Ptr& observation);
  void insertPoses(Tracker& tracker);
  void end();
  bool isFinal(const Entry& entry) const;

  std::unique_ptr<Recording> recording_;
  TrackerFaults faults_;
  std::int64_t read_ahead_ns_ = 0;
  std::map<PoseSourceId, std::unique_ptr<Tracker>> trackers_;
  std::deque<Entry> ready_;
  std::optional<std::int64_t> newest_ns_;  // of the observations read
  bool ended_ = false;
  std::exception_ptr error_;  // the error that ended the recording
  std::string position_ = "the recording";
};

}  // namespace efm
