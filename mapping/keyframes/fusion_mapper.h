// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include "mapping/dsi/dsi_grid.h"
#include "mapping/events/event.h"
#include "mapping/events/event_filter.h"
#include "mapping/events/window.h"
#include "mapping/geometry/lens.h"
#include "mapping/geometry/rig.h"
#include "mapping/geometry/trajectory.h"
#include "mapping/keyframes/camera_stream.h"
#include "mapping/keyframes/keyframe_depth_map.h"
#include "mapping/keyframes/keyframe_mapper.h"
#include "mapping/keyframes/keyframe_policy.h"
#include "mapping/keyframes/mapper_counts.h"

namespace efm {

struct FusionMapperOptions {
  TrajectoryOptions trajectory;
  KeyframePolicyOptions policy;
  /// If given, this window is the only keyframe, and `policy` is not used.
  std::optional<Window> only_window;
  /// If not empty, these windows are the keyframes, and `policy` is not used: an earlier pass over
  /// the same data found them. They are in the order of `t0_ns`.
  std::vector<Window> planned_windows;
  /// If given, no window is mapped: this receives each one that would be, and the number of events
  /// in it. Then the counts have what a mapping counts of the events.
  std::function<void(const Window&, std::uint64_t events)> on_planned;
  /// If the last window of the recording is not full, it is moved back so that it ends right after
  /// the last event with a pose. Then it overlaps the window before it. It is skipped if it adds
  /// less than a tenth of what other windows add.
  bool fill_last_window = true;
  KeyframeMapperOptions keyframe;
  std::vector<int> cameras;  ///< Indices of the cameras that take part, each once; empty: all.
  TimeLimits limits;         ///< Events and windows outside the limits are not used.
  EventFilterOptions filter;
  /// As long as fewer events are held, a silent camera delays the others: it may deliver later.
  std::size_t max_waiting_events = 0;

  /// Returns the time interval of the events that are used, also those that tell which ones the
  /// filters remove.
  TimeLimits interval() const;
  /// Returns `only_window`, or `planned_windows`.
  std::vector<Window> givenWindows() const {
    return only_window ? std::vector<Window>{*only_window} : planned_windows;
  }
  void validate() const;
};

/// Maps events and poses to keyframes: buffers the input, and maps a window once its events and
/// poses are complete. Deterministic: keyframes depend on the data, not on its packets. Not
/// thread-safe.
///
/// Use: `addCamera` for each camera; then `addPose` and `addEvents` as data arrives, and after each
/// call `next` until it returns std::nullopt; at the end `finish`, and `next` again.
class FusionMapper : private RecordingProgress {
 public:
  explicit FusionMapper(const FusionMapperOptions& options);

  /// Adds a camera. Inverts the lens of a selected camera, pixel by pixel.
  /// @return the camera's index. All cameras are added before the first keyframe.
  /// @throws std::invalid_argument naming the value of the calibration that is not valid;
  /// std::logic_error after the first keyframe.
  int addCamera(const RigCamera& camera);
  /// @throws std::invalid_argument if the pose is not valid, or is more than a second older than
  /// the newest pose.
  void addPose(const StampedPose& pose);
  /// Adds the next events of a camera. Events that are up to 10 ms older than an event before them
  /// are sorted and counted.
  /// @throws std::invalid_argument if they begin over 10 ms before the newest event of earlier
  /// calls. Then no event of this call is added.
  void addEvents(int camera, CheckedEvents events);
  /// Declares that all of a camera's events before `t_ns` (its own clock) have been added, so that
  /// a camera without events does not delay other cameras. Without this call, a camera's events are
  /// complete until 10 ms before its newest event. A camera is silent if it has no event in the
  /// last second before the newest packet of any camera begins. A silent camera delays no other,
  /// but see `max_waiting_events`.
  void setCompleteUntil(int camera, std::int64_t t_ns) {
    cameras_.at(static_cast<std::size_t>(camera)).setCompleteUntil(t_ns);
  }
  /// Does the same for all cameras, with `t_ns` on the trajectory's clock. Poses before `t_ns` are
  /// forgotten if no window needs them.
  void setAllCompleteUntil(std::int64_t t_ns);
  /// Declares that no more data will come. Windows that are not full are not mapped: the last
  /// window begins earlier (`fill_last_window`). A recording shorter than a window has no keyframe.
  void finish() { finished_ = true; }

  /// Maps the next complete window, if there is one. This call does the whole work of a keyframe.
  std::optional<KeyframeDepthMap> next(DsiSink* sink = nullptr, StageTimes* times = nullptr);

  /// Returns the data of the window that `next` would map, without mapping it.
  /// @return std::nullopt if no window is complete; after `finish` the data of `rest` instead.
  ///   Valid until data are added or a window is mapped or skipped.
  std::optional<WindowData> window();
  /// Returns the window that `next` would map, if there is one.
  std::optional<Window> nextWindow();
  /// Returns the data that fill no window: from the beginning of the next window to the time until
  /// which events and poses are complete. Valid as long as the data of `window`.
  /// @return std::nullopt if there are no such data.
  std::optional<WindowData> rest() const;
  /// Goes on to the next window without mapping `window`.
  void skipWindow(const Window& window);
  /// Skips the window, and counts it as dropped.
  void dropWindow(const Window& window, DropReason reason);
  /// Drops, for an error, the window that `next` was mapping when it threw.
  /// @return whether there was such a window. If not, the next call of `next` tries again.
  bool dropFailedWindow();
  /// Drops the windows that begin before a time, with or without data, and releases the events
  /// before that time. Such an event that comes later counts as dropped (as late for `kPaused`).
  /// The events of these windows count as dropped too, unless another window uses them or the
  /// reason is `kPaused`.
  void dropWindowsBefore(std::int64_t t_ns, DropReason reason);
  /// Calls `dropWindowsBefore` for the time right after all events so far.
  void dropAllWindows(DropReason reason) { dropWindowsBefore(reachedNs() + 1, reason); }
  /// Takes the newest keyframe out of the counts: its window counts as dropped for an error.
  void loseKeyframe();
  /// Returns the number of added events of all cameras: the sum of `EventCounts::read`.
  std::uint64_t readEvents() const;
  /// Returns the number of events that windows may still need.
  std::size_t heldEvents() const;
  /// Returns the time of the first of these events; kMaxTimeNs if there is none.
  std::int64_t oldestHeldNs() const;
  /// Returns the time until which the events of the selected cameras are complete.
  std::int64_t eventsCompleteNs() const;
  /// Replaces options, as if they had been given at the start. Goes on with the first window whose
  /// events are all held. Before the first keyframe, the windows before it are dropped.
  void configure(const KeyframePolicyOptions& policy, const DepthPlanesOptions& planes);
  /// Sets the depth planes of the next keyframes.
  void setPlanes(const DepthPlanesOptions& planes);
  /// Sets the correction of the motion of the next keyframes.
  void setMotion(const MotionCorrectionOptions& motion);

  std::uint64_t correctedKeyframes() const { return counts_.motion.corrected; }
  /// Returns the counts, complete once `finish` was called and `next` returned std::nullopt.
  MapperCounts counts() const;
  const Rig& rig() const { return rig_; }
  /// Returns the viewing rays of the selected cameras.
  const std::vector<UndistortionTable>& undistortion() const { return undistortion_; }
  const Trajectory& trajectory() const { return trajectory_; }

 private:
  void filterEvents();
  void findStart();
  void skipEmptyWindows();
  std::optional<Window> completeWindow();
  std::optional<Window> lastWindow();
  std::vector<EventSpan> eventsOf(const Window& window) const;
  void loseEvents(std::int64_t t0_ns, std::int64_t t1_ns, DropReason reason);
  bool isComplete(const Window& window) const;
  std::optional<KeyframeDepthMap> mapWindow(const Window& window, DsiSink* sink, StageTimes* times);
  KeyframeMapper& keyframeMapper() const;
  std::int64_t releasableUntil() const;
  void releaseBefore(std::int64_t t_ns);

  std::int64_t completeUntil(const CameraStream& camera) const;
  std::size_t countBefore(std::int64_t t_ns) const;

  // RecordingProgress, for the policy.
  std::int64_t startNs() const override { return *start_ns_; }
  std::int64_t reachedNs() const override { return reached_ns_.value_or(kMinTimeNs); }
  std::int64_t completeNs() const override;
  std::optional<std::int64_t> timeOfEvent(std::int64_t from_ns, std::int64_t count) const override;
  std::int64_t eventsIn(std::int64_t t0_ns, std::int64_t t1_ns) const override {
    return static_cast<std::int64_t>(countBefore(t1_ns) - countBefore(t0_ns));
  }
  std::optional<Rigid3> viewPoseAt(std::int64_t t_ns) const override;
  const ReferenceView& view() const override { return keyframeMapper().view(); }

  FusionMapperOptions options_;
  Rig rig_;
  std::vector<UndistortionTable> undistortion_;  // of selected cameras: mapper_ shares their rays
  Trajectory trajectory_;
  std::unique_ptr<KeyframePolicy> policy_;
  mutable std::unique_ptr<KeyframeMapper> mapper_;  // made when first needed: the rig is complete
  std::vector<CameraStream> cameras_;
  std::optional<std::int64_t> start_ns_;    // first event with a pose
  std::optional<std::int64_t> reached_ns_;  // newest event of any camera, selected or not
  std::optional<std::int64_t> packet_ns_;   // first event of the newest packet of any camera
  std::int64_t silent_ns_ = kMinTimeNs;     // no camera delays the others before this time
  std::int64_t released_ns_ = kMinTimeNs;   // earlier events are counted and released
  bool finished_ = false;
  std::optional<std::int64_t> given_ns_;  // begin of the given windows, if there are such
  std::optional<Window> failed_;          // `next` began to map it and threw
  MapperCounts counts_;                   // without the counts of the cameras
};

}  // namespace efm
