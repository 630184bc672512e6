// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <mrpt/obs/CObservation.h>

#include <cstddef>
#include <cstdint>
#include <exception>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "mapping/base/text.h"
#include "mapping/geometry/rig.h"
#include "mapping/geometry/trajectory.h"
#include "plugin/mrpt/CObservationEvents.h"
#include "plugin/recordings/streams/event_packets.h"
#include "plugin/session/event_fusion_options.h"

namespace efm {

/// Oddities of a recording that could be read.
struct RecordingCounts {
  std::uint64_t sorted_events = 0;  ///< Came up to 10 ms after a newer one.
  std::uint64_t lost_packets = 0;  ///< Missing in the numbers that the recording gives its packets.
  std::uint64_t undated_events = 0;  ///< Left out: see `EventStream::undatedEvents`.
  std::uint64_t skipped_events = 0;  ///< Bad ones, left out: see `BadEvents`.
  std::string first_skipped;         ///< The error of the first of them.
  std::vector<Warning> warnings;     ///< Of the readers: see `EventStream::warnings`.
};

/// A recording as a stream of observations in the order of time: CObservationEvents,
/// CObservationRobotPose and the other observations of a rawlog. A pose comes before the packets
/// that begin at its time or later. Memory does not grow with the length of the recording.
class Recording {
 public:
  virtual ~Recording() = default;

  /// @return the next observation; null at the end.
  virtual mrpt::obs::CObservation::Ptr next() = 0;

  /// The position of the last observation that `next` returned: "entry 12 of my.rawlog".
  virtual std::string position() const = 0;

  /// The fraction of the input that was read, 0 to 1.
  virtual double progress() const = 0;

  virtual RecordingCounts counts() const { return {}; }
};

/// A recording with another calibration in its packets and another hand-eye transform in its poses.
/// For commands that write or show observations; a map builder has options for both.
class RigOverrideRecording : public Recording {
 public:
  RigOverrideRecording(std::unique_ptr<Recording> recording, RigSetup setup);

  /// @throws std::invalid_argument where the calibration lacks a camera or has another size of it;
  /// at the end where it has more cameras than the recording.
  mrpt::obs::CObservation::Ptr next() override;
  std::string position() const override { return recording_->position(); }
  double progress() const override { return recording_->progress(); }
  RecordingCounts counts() const override { return recording_->counts(); }

 private:
  std::unique_ptr<Recording> recording_;
  RigSetup setup_;
  std::set<int> cameras_;  // seen so far
};

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

/// The event streams of a rig's cameras, as observations in the order of time.
///
/// The first packets are empty, one per camera: they announce the rig (see CObservationEvents).
/// Each further packet has the events of one camera in a period. A packet covers its camera until
/// the camera's next event, and the camera's last packet covers it for ever (`kEndOfTimeNs`):
/// nobody waits for a silent camera. The very last packet has no such time: there the recording
/// ends. If a stream has a wrong event, all events before it come before the error.
class MergedRecording : public Recording {
 public:
  /// @param cameras one per camera of the rig; of none, there is no observation.
  /// @param skip_bad_events the number of bad events that are left out, of all cameras together; a
  /// further one is an error.
  MergedRecording(Rig rig, std::vector<EventPackets> cameras, std::uint64_t skip_bad_events = 0);

  /// Adds to the warnings of `counts`.
  void addWarnings(std::vector<Warning> warnings) { warnings_ = std::move(warnings); }

  /// @throws std::runtime_error if there are cameras and none has an event; the streams' errors.
  void requireEvents();

  mrpt::obs::CObservation::Ptr next() override;
  std::string position() const override { return position_; }
  double progress() const override;
  RecordingCounts counts() const override;

 private:
  std::optional<std::size_t> nextCamera();
  mrpt::obs::CObservation::Ptr packetOf(std::size_t camera, std::int64_t t_ns,
                                        std::vector<Event> events);

  Rig rig_;
  std::unique_ptr<BadEvents> bad_;     // the cameras refer to it
  std::vector<EventPackets> cameras_;  // per camera
  std::vector<Warning> warnings_;
  std::string position_ = "the recording";
  std::size_t announced_ = 0;  // number of empty packets so far
};

}  // namespace efm
