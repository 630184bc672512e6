// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <deque>
#include <exception>
#include <map>
#include <memory>
#include <optional>
#include <string>

#include "plugin/recordings/recording.h"
#include "plugin/session/pose_source_selector.h"
#include "tracking_stub/faults/tracker_faults.h"

namespace efm {

/// A recording whose trackers have faults: its CObservationRobotPose are lost, wrong and late as
/// asked for, each source's with the same draws. Odometry, what movements of actions add up to, and
/// all else stay as they are; so does what a pose's observation says beside the pose. Poses that
/// mark a jump are copies with a stamp of their own, one of MRPT's ticks apart.
///
/// Poses come before the packets that begin at their time or later, but for the latency: then each
/// comes behind the pose that is so much newer. With noise per keyframe it reads ahead by as much
/// as poses may be apart.
class PerturbedRecording : public Recording {
 public:
  /// @param faults ticks are MRPT's, whatever they say.
  /// @throws std::invalid_argument where the faults are not valid.
  PerturbedRecording(std::unique_ptr<Recording> recording, const TrackerFaults& faults);
  ~PerturbedRecording() override;

  /// Where the recording cannot be read on, its error comes behind what was read before.
  /// @throws std::invalid_argument where a pose has no time or one older than that before it.
  mrpt::obs::CObservation::Ptr next() override;
  std::string place() const override { return place_; }
  double progress() const override { return recording_->progress(); }
  RecordingCounts counts() const override { return recording_->counts(); }

 private:
  class Tracker;
  struct Entry {
    mrpt::obs::CObservation::Ptr observation;
    std::optional<std::int64_t> t_ns;
    std::string place;
  };

  void readOne();
  void take(const mrpt::obs::CObservation::Ptr& observation);
  void takePoses(Tracker& tracker);
  void end();
  bool isSettled(const Entry& entry) const;

  std::unique_ptr<Recording> recording_;
  TrackerFaults faults_;
  std::int64_t read_ahead_ns_ = 0;
  std::map<PoseSourceId, std::unique_ptr<Tracker>> trackers_;
  std::deque<Entry> ready_;
  std::optional<std::int64_t> newest_ns_;  // that was read
  bool ended_ = false;
  std::exception_ptr error_;  // that ended it
  std::string place_ = "the recording";
};

}  // namespace efm
