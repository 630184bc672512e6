// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <iterator>
#include <map>
#include <memory>
#include <optional>
#include <vector>

#include "mapping/dsi/dsi_grid.h"
#include "mapping/events/event.h"
#include "mapping/events/event_fate.h"
#include "mapping/events/event_filter.h"
#include "mapping/events/window.h"
#include "mapping/geometry/lens.h"
#include "mapping/geometry/rig.h"
#include "mapping/geometry/trajectory.h"
#include "mapping/keyframes/camera_stream.h"
#include "mapping/keyframes/keyframe_depth_map.h"
#include "mapping/keyframes/keyframe_mapper.h"
#include "mapping/keyframes/keyframe_policy.h"

namespace efm {

struct FusionMapperOptions {
  TrajectoryOptions trajectory;
  KeyframePolicyOptions policy;
  /// If given, this window is the only keyframe, and `policy` is not used.
  std::optional<Window> only_window;
  /// At the end of the recording, where the last window is not full: one that is full and ends
  /// right after the last event with a pose. So it overlaps the window before. Not where it
  /// adds less than a tenth of what other windows add.
  bool fill_last_window = true;
  KeyframeMapperOptions keyframe;
  std::vector<int> cameras;  ///< Indices of the cameras that take part, each once; empty: all.
  TimeLimits limits;         ///< Events and windows outside are not used.
  EventFilterOptions filter;

  /// The time of the events that are used.
  TimeLimits interval() const {
    return only_window ? TimeLimits{only_window->t0_ns, only_window->t1_ns} : limits;
  }
  void validate() const;
};

/// Why a window was dropped.
enum class DropReason {
  kOverload,    ///< Too much input waited, or input was dropped.
  kTooLarge,    ///< It has more events than the queue of live operation holds.
  kJump,        ///< The tracker jumped within it.
  kNoPose,      ///< Its poses did not come in time.
  kNoScene,     ///< It showed no scene to choose automatic options from.
  kError,       ///< It could not be mapped.
  kPaused,      ///< Map updating was disabled.
  kClockReset,  ///< It waited when a clock went back.
};

struct DropReasonRow {
  DropReason reason;
  const char* key;   ///< In report.json.
  const char* text;  ///< What follows "3 windows".
};
inline constexpr DropReasonRow kDropReasons[] = {
    {DropReason::kOverload, "overload", "for overload"},
    {DropReason::kTooLarge, "too_large", "larger than the queue"},
    {DropReason::kJump, "jump", "across a jump of the tracker"},
    {DropReason::kNoPose, "no_pose", "without poses"},
    {DropReason::kNoScene, "no_scene", "without a scene"},
    {DropReason::kError, "error", "for errors"},
    {DropReason::kPaused, "paused", "while map updating was disabled"},
    {DropReason::kClockReset, "clock_reset", "at a clock reset"},
};
using DroppedWindows = CountsBy<DropReason, std::size(kDropReasons)>;

struct MapperCounts {
  std::vector<EventCounts> cameras;
  std::uint64_t event_uses = 0;  ///< Summed over keyframes, which may overlap.
  VoteCounts votes;
  std::uint64_t keyframes = 0;
  std::uint64_t keyframes_without_pose = 0;  ///< Windows whose reference time had no pose.
  std::uint64_t windows_without_events = 0;  ///< Skipped: no selected camera has events.
  DroppedWindows dropped_windows;            ///< By `dropWindow` and `dropWindowsBefore`.
  std::uint64_t silent_subintervals = 0;     ///< Summed over keyframes; without silent cameras.
  std::uint64_t sorted_events = 0;           ///< Came after a newer one of their camera.
  std::uint64_t late_events = 0;             ///< See `FusionMapper::dropLate`.
  std::uint64_t duplicate_poses = 0;

  EventCounts total() const;
  MapperCounts& operator+=(const MapperCounts& other);
};

/// Events and poses in, keyframes out: buffers the input and maps a window as soon as events and
/// poses cover it. Deterministic: keyframes depend on the data alone, not on the packets it arrives
/// in. Not thread-safe.
///
/// Use: `addCamera` for each camera; then `addPose` and `addEvents` as data arrives, and after each
/// call `next` until it returns nothing; at the end `finish`, and `next` again.
class FusionMapper : private RecordingProgress {
 public:
  explicit FusionMapper(const FusionMapperOptions& options);

  /// Inverts the lens of a selected camera, pixel by pixel.
  /// @return the camera's index. All cameras are added before the first keyframe.
  /// @throws std::invalid_argument naming the value of the calibration that is not valid;
  /// std::logic_error after the first keyframe.
  int addCamera(const RigCamera& camera);
  /// @throws std::invalid_argument where the pose is not valid, or more than a second older than
  /// the newest.
  void addPose(const StampedPose& pose);
  /// @param events of one camera. Events that come up to 10 ms after a newer one are sorted and
  /// counted.
  /// @throws std::invalid_argument where an event is later than that, or lies outside the sensor;
  /// then no event of this call is taken.
  /// @param checked the events lie inside the sensor, and are in the order of time.
  void addEvents(int camera, std::vector<Event> events, bool checked = false);
  /// Whether a camera's clock may have gone back: the events are in order, and each one comes more
  /// than 10 ms after a newer one of earlier calls.
  bool isOlder(int camera, const std::vector<Event>& events) const {
    return cameras_.at(static_cast<std::size_t>(camera)).isOlder(events);
  }
  /// Before `addEvents`, where such events are no error: takes out the events that come more than
  /// 10 ms after a newer one, and counts them as read and dropped.
  void dropLate(int camera, std::vector<Event>& events) {
    counts_.late_events += cameras_.at(static_cast<std::size_t>(camera)).dropLate(events);
  }
  /// Says that all of a camera's events before `t_ns` (its own clock) have been added, so that a
  /// camera without events does not delay the others. Without this call, a camera's events are
  /// complete until 10 ms before its newest one. A camera is silent if it has no event in the last
  /// second before the newest packet of any camera begins. A silent camera does not delay others.
  void coverUntil(int camera, std::int64_t t_ns) {
    cameras_.at(static_cast<std::size_t>(camera)).coverUntil(t_ns);
  }
  /// The same for all cameras. `t_ns` is on the trajectory's clock. Poses before it are forgotten
  /// where no window needs them.
  void coverAllUntil(std::int64_t t_ns);
  /// No more data will come. Windows that are not full are not mapped: the last one begins earlier
  /// (`fill_last_window`). A recording that is shorter than a window has none.
  void finish() { finished_ = true; }

  /// Maps the next window that is covered, if there is one. Costs the keyframe's whole work.
  std::optional<KeyframeDepthMap> next(DsiSink* sink = nullptr, StageHook* stages = nullptr);

  /// The data of the window that `next` would map: without mapping it, and without its keyframe.
  /// @return nothing where no window is covered; after `finish` also the rest.
  ///   Valid until data are added or a window is mapped or skipped.
  std::optional<WindowData> window();
  /// The window that `next` would map, if there is one.
  std::optional<Window> nextWindow();
  /// The data that no window fills: from the beginning of the next window to where events and poses
  /// are complete. @return nothing where there are none. Valid as those of `window`.
  std::optional<WindowData> rest() const;
  /// Goes on to the next window without mapping this one.
  void skipWindow(const Window& window);
  /// The same; the window counts as given up.
  void dropWindow(const Window& window, DropReason reason);
  /// After `next` has thrown: gives up the window that it was mapping, for an error.
  /// @return whether there was one. Otherwise the next call of `next` tries the same again.
  bool dropFailedWindow();
  /// Gives up the windows that begin before a time, with or without data, and releases the events
  /// before it. Such an event that comes later is counted as dropped, and so is each event of these
  /// windows that no other one uses, unless the reason is `paused`.
  void dropWindowsBefore(std::int64_t t_ns, DropReason reason);
  /// The same for all events so far.
  void dropAllWindows(DropReason reason) { dropWindowsBefore(reachedNs() + 1, reason); }
  /// The newest keyframe is not kept: its window counts as given up for an error.
  void loseKeyframe();
  /// All events that were added, of all cameras: the sum of `EventCounts::read`.
  std::uint64_t readEvents() const;
  /// The events that windows may still need.
  std::size_t heldEvents() const;
  /// The time of the first of them; kMaxTimeNs if there is none.
  std::int64_t oldestHeldNs() const;
  /// No event of a selected camera before this time is still to come.
  std::int64_t eventsCompleteNs() const;
  /// Replaces options, as if they had been given at the start. Goes on with the first window whose
  /// events are all held; before the first keyframe those before it are given up.
  void configure(const KeyframePolicyOptions& policy, const DepthPlanesOptions& planes);
  /// The depth planes of the keyframes from now on.
  void setPlanes(const DepthPlanesOptions& planes);

  /// Complete once `finish` was called and `next` returned nothing.
  MapperCounts counts() const;
  const Rig& rig() const { return rig_; }
  const Trajectory& trajectory() const { return trajectory_; }

 private:
  void filterEvents();
  void findStart();
  void skipEmptyWindows();
  std::optional<Window> coveredWindow();
  std::optional<Window> lastWindow();
  std::vector<EventSpan> eventsOf(const Window& window) const;
  void loseEvents(std::int64_t t0_ns, std::int64_t t1_ns, DropReason reason);
  bool isCovered(const Window& window) const;
  std::optional<KeyframeDepthMap> mapWindow(const Window& window, DsiSink* sink, StageHook* stages);
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
  mutable std::map<int, UndistortionTable> undistortion_;  // of selected cameras, until mapper_
  Trajectory trajectory_;
  std::unique_ptr<KeyframePolicy> policy_;
  mutable std::unique_ptr<KeyframeMapper> mapper_;  // made when first needed: the rig is complete
  std::vector<CameraStream> cameras_;
  std::optional<std::int64_t> start_ns_;    // first event with a pose
  std::optional<std::int64_t> reached_ns_;  // newest event of any camera, selected or not
  std::optional<std::int64_t> packet_ns_;   // first event of the newest packet of any camera
  std::int64_t released_ns_ = kMinTimeNs;   // earlier events are counted and released
  bool finished_ = false;
  std::optional<Window> failed_;  // `next` began to map it, and did not end
  MapperCounts counts_;           // without those of the cameras
};

}  // namespace efm
