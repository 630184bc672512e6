// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>
#include <map>
#include <optional>
#include <vector>

#include "mapping/keyframes/fusion_mapper.h"
#include "plugin/recordings/streams/sample.h"
#include "plugin/session/event_fusion_options.h"
#include "plugin/session/pose_source_selector.h"
#include "plugin/session/session_status.h"

namespace efm {

/// Missing events of a camera: until a time on its clock, and the reason.
struct MissingEvents {
  std::int64_t until_ns = std::numeric_limits<std::int64_t>::min();
  DropReason reason = DropReason::kOverload;
};

/// Pose of the rig, and the standard deviations that its tracker states.
struct NoisyPose {
  StampedPose pose;
  std::optional<PoseNoise> noise;
};

/// Decides which input of live operation may pass to the mapper now. A sensor does not wait and
/// cannot be read again: data may come late, a clock may go back, the tracker may jump, packets may
/// be missing, and poses or events may not come at all. In playback all input passes, because the
/// readers have checked it. Only packets that the host skips are missing in playback, too.
///
/// Times are on the clock of the poses if nothing else is said.
class LiveGuard {
 public:
  /// Index of the tracker among the cameras.
  static constexpr int kTracker = -1;

  explicit LiveGuard(const LiveOptions& options) : options_(options) {}

  // --- Late data and clock resets ---

  /// Removes the late events from a packet.
  /// @return the begin of the packet if all of its events are older than earlier ones. The mapper
  /// rejects such a packet. Otherwise std::nullopt.
  std::optional<std::int64_t> admit(FusionMapper& mapper, EventPacket& packet) const;
  /// Reports rejected data that are older than earlier data. If a sensor sends only older data for
  /// a second of its clock, the clock went back. If other cameras continue ahead of a camera, only
  /// its own clock is wrong, and that is no reset.
  void noteOlder(int sensor, std::int64_t t_ns);
  /// Reports a rejected pose as `noteOlder` does, if it is over a second old.
  void noteOlderPose(std::int64_t t_ns);
  /// Reports data that are not older than earlier data.
  void noteInTime(int sensor, std::int64_t t_ns);
  /// Returns whether a clock went back: new input belongs to the new clock.
  bool clockWentBack() const { return clock_went_back_; }
  /// Holds input of the new clock until the complete windows of the former one are mapped.
  void hold(std::function<void()> input, std::size_t events = 0);
  std::size_t heldEvents() const { return held_events_; }
  /// Forgets the former clock. @return the held input, in order.
  std::vector<std::function<void()>> beginClock();

  // --- Jumps of the tracker ---

  /// Holds a pose after an implausible motion from the pose before it, and all later poses.
  /// @return true if the pose is held.
  bool holdsPose(const NoisyPose& pose);
  /// Reports a pose that the mapper took.
  void notePose(const StampedPose& pose);
  /// Returns whether poses after a jump are held.
  bool jumped() const { return !after_jump_.empty(); }
  /// Return the times on both sides of the jump: newest pose before it, first pose after it.
  std::int64_t beforeJumpNs() const { return newest_pose_->t_ns; }
  std::int64_t afterJumpNs() const { return after_jump_.front().pose.t_ns; }
  /// Continues with the poses after the jump. @return these poses.
  std::vector<NoisyPose> beginSegment();

  // --- Missing events ---

  void noteMissing(int camera, const MissingEvents& missing);
  /// Drops the windows that need missing events of a camera.
  /// @param next_ns the camera's next data begin here at the latest. No event is missing after it.
  void dropMissing(FusionMapper& mapper, int camera, std::int64_t next_ns);
  /// Drops the windows that need missing events of cameras that send nothing any more.
  /// @param newest_begin_ns begin of the newest packet of any camera.
  void dropOverdue(FusionMapper& mapper, std::int64_t newest_begin_ns);
  /// Drops all windows that need missing events, at the end of the input.
  void dropAllMissing(FusionMapper& mapper);

  // --- Waits ---

  /// Returns whether this number of events fills half of the queue.
  bool fillsQueue(std::uint64_t events) const;
  /// Limits the time that events and poses wait for each other: drops the windows whose poses are
  /// overdue, and treats overdue events as silence.
  /// @param events times of the events so far.
  /// @return the time before which no pose is needed any more; std::nullopt if all may be.
  std::optional<std::int64_t> limitWaits(FusionMapper& mapper, PoseSourceSelector& pose_source,
                                         const std::optional<TimeSpan>& events);

  /// Counts a rejected pose. @return false in playback, where the rejection is an error.
  bool countRejectedPose();
  void setTooLarge(const std::string& why) { status_.too_large = why; }
  /// Returns the guard's counts, and the lost events of each camera; std::nullopt in playback.
  /// @param rejected events of rejected packets, by camera. @param selected see isSelected.
  std::optional<LiveStatus> status(const std::map<int, std::uint64_t>& rejected = {},
                                   const MapperCounts& counts = {},
                                   const std::vector<int>& selected = {}) const;

 private:
  bool isJump(const NoisyPose& pose) const;
  std::optional<std::int64_t> missingUntil(const FusionMapper& mapper, int camera) const;

  /// A sensor that sends older data than before.
  struct Older {
    std::int64_t since_ns;
    std::map<int, std::int64_t> others_ns;  // newest times of the cameras that continue
  };

  LiveOptions options_;
  LiveStatus status_;
  std::map<int, Older> older_;  // by camera, or the tracker
  bool clock_went_back_ = false;
  std::vector<std::function<void()>> held_;  // input of the new clock
  std::size_t held_events_ = 0;
  std::optional<StampedPose> newest_pose_;  // of the selected source, as the tracker has it
  std::vector<NoisyPose> after_jump_;
  std::map<int, MissingEvents> missing_;  // by camera
};

}  // namespace efm
