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
#include "plugin/session/event_fusion_options.h"
#include "plugin/session/pose_source_selector.h"
#include "plugin/session/sample.h"
#include "plugin/session/session_status.h"

namespace efm {

/// Events of a camera that are missing, until a time on its clock, and why.
struct MissingEvents {
  std::int64_t until_ns = std::numeric_limits<std::int64_t>::min();
  DropReason reason = DropReason::kOverload;
};

/// A pose of the rig, and the standard deviations that its tracker states.
struct NoisyPose {
  StampedPose pose;
  std::optional<PoseNoise> noise;
};

/// Decides which input of live operation may pass to the mapper now. A sensor does not wait and
/// cannot be read again: data may come late, a clock may go back, the tracker may jump, packets may
/// be missing, and poses or events may not come at all. In playback all input passes, because the
/// readers have checked it; packets that the host skips are missing there, too.
///
/// Times are on the clock of the poses, if nothing else is said.
class LiveGuard {
 public:
  /// Stands for the tracker among the cameras.
  static constexpr int kTracker = -1;

  explicit LiveGuard(const LiveOptions& options) : options_(options) {}

  // --- Late data and clock resets ---

  /// Takes the late events out of a packet.
  /// @return the begin of the packet if all of it is older than what came before. The mapper
  /// rejects such a packet.
  std::optional<std::int64_t> admit(FusionMapper& mapper, EventPacket& packet) const;
  /// Reports data that are older than those before, and were rejected. If a sensor sends nothing
  /// else for a second of its clock, the clock went back. If other cameras go on ahead of a camera,
  /// its clock alone is wrong, and that is no reset.
  void noteOlder(int sensor, std::int64_t t_ns);
  /// The same for a rejected pose, if it is over a second old.
  void noteOlderPose(std::int64_t t_ns);
  /// Reports data that are not older.
  void noteInTime(int sensor, std::int64_t t_ns);
  /// Whether a clock went back: what comes now belongs to the new clock.
  bool clockWentBack() const { return clock_went_back_; }
  /// Holds input of the new clock until the complete windows of the former one are mapped.
  void hold(std::function<void()> input, std::size_t events = 0);
  std::size_t heldEvents() const { return held_events_; }
  /// Forgets the former clock. @return the held input, in order.
  std::vector<std::function<void()>> beginClock();

  // --- Jumps of the tracker ---

  /// Holds a pose that no motion explains after the one before it, and all poses after that.
  /// @return whether it is held.
  bool holdsPose(const NoisyPose& pose);
  /// Reports a pose that the mapper took.
  void notePose(const StampedPose& pose);
  /// Whether poses after a jump are held.
  bool jumped() const { return !after_jump_.empty(); }
  /// The times on both sides of the jump: of the newest pose before it and of the first one after.
  std::int64_t beforeJumpNs() const { return newest_pose_->t_ns; }
  std::int64_t afterJumpNs() const { return after_jump_.front().pose.t_ns; }
  /// Goes on to the poses after the jump. @return these poses.
  std::vector<NoisyPose> beginSegment();

  // --- Missing events ---

  void noteMissing(int camera, const MissingEvents& missing);
  /// Drops the windows that need missing events of a camera.
  /// @param next_ns the camera's next data begin here at the latest: none is missing afterwards.
  void dropMissing(FusionMapper& mapper, int camera, std::int64_t next_ns);
  /// The same for cameras that send nothing any more.
  /// @param newest_begin_ns the begin of the newest packet of any camera.
  void dropOverdue(FusionMapper& mapper, std::int64_t newest_begin_ns);
  /// At the end of the input: no event is still to come.
  void dropAllMissing(FusionMapper& mapper);

  // --- Waits ---

  /// Whether so many events fill half of the queue.
  bool fillsQueue(std::uint64_t events) const;
  /// Neither events nor poses wait for the others without end: drops the windows whose poses are
  /// overdue, and takes overdue events for silence.
  /// @param events the events so far.
  /// @return poses before this time are not needed any more; std::nullopt if all may be.
  std::optional<std::int64_t> limitWaits(FusionMapper& mapper, PoseSourceSelector& pose_source,
                                         const std::optional<TimeSpan>& events);

  /// Counts a rejected pose. @return false in playback, where it is an error.
  bool countRejectedPose();
  void setTooLarge(const std::string& why) { status_.too_large = why; }
  /// What the guard counted, and the events that each camera lost; std::nullopt in playback.
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
    std::map<int, std::int64_t> others_ns;  // cameras that go on, and until when
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
