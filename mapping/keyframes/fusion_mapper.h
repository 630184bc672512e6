// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "mapping/dsi/vote_counts.h"
#include "mapping/events/event.h"
#include "mapping/events/event_buffer.h"
#include "mapping/events/event_filter.h"
#include "mapping/geometry/rig.h"
#include "mapping/geometry/trajectory.h"
#include "mapping/keyframes/keyframe_mapper.h"
#include "mapping/keyframes/keyframe_policy.h"
#include "mapping/keyframes/stage.h"

namespace efm {

/// Half-open [t0, t1) on the trajectory's clock; an end that is not given is no limit.
struct TimeLimits {
  std::optional<std::int64_t> t0_ns;
  std::optional<std::int64_t> t1_ns;

  bool hold(std::int64_t t_ns) const {
    return (!t0_ns || t_ns >= *t0_ns) && (!t1_ns || t_ns < *t1_ns);
  }
  /// @throws std::invalid_argument where t1 is not after t0.
  void validate() const;
};

struct FusionMapperOptions {
  TrajectoryOptions trajectory;
  KeyframePolicyOptions keyframes;
  /// Where given, this window is the only keyframe and `keyframes` does not matter.
  std::optional<Window> only_window;
  KeyframeMapperOptions keyframe;
  std::vector<int> cameras;   ///< Indices of the cameras that take part, each once; empty: all.
  TimeLimits limits;          ///< Events outside are in no window, and no window reaches beyond.
  EventFilterOptions filter;  ///< What of the events inside no window ever sees.

  /// @throws std::invalid_argument naming the field, its value and the allowed range.
  void validate() const;
};

/// What became of one camera's events: distinct events, so read = used + the rest.
struct EventCounts {
  std::uint64_t read = 0;
  std::uint64_t used = 0;            ///< Voted in at least one keyframe.
  std::uint64_t without_pose = 0;    ///< Not used: the trajectory has no pose at its time.
  std::uint64_t outside_window = 0;  ///< Not used: in no window that was mapped.
  std::uint64_t dropped = 0;   ///< Came after its window was closed, or of an unselected camera.
  std::uint64_t filtered = 0;  ///< Left out as noise, whether they have a pose or not.

  EventCounts& operator+=(const EventCounts& other);
};

struct MapperCounts {
  std::vector<EventCounts> cameras;
  std::uint64_t event_uses = 0;  ///< Summed over keyframes, which may overlap.
  VoteCounts votes;
  std::uint64_t keyframes = 0;
  std::uint64_t keyframes_without_pose = 0;  ///< Windows whose reference time had no pose.
  std::uint64_t windows_without_events = 0;  ///< Passed over: no selected camera saw anything.
  std::uint64_t silent_subintervals = 0;     ///< Summed over keyframes, but of silent cameras.
  std::uint64_t sorted_events = 0;           ///< Came after a newer one of their camera.
  std::uint64_t duplicate_poses = 0;

  EventCounts total() const;
};

/// Events and poses in, keyframes out: buffers what arrives, and maps a window as soon as events
/// and poses cover it. Deterministic: keyframes depend on the data alone, not on how it was cut
/// into packets. Not thread-safe.
///
/// Use: `addCamera` for each camera; then `addPose` and `addEvents` as they come, and after each
/// `next` until it gives nothing; at the end `finish`, and `next` again.
class FusionMapper {
 public:
  /// @throws std::invalid_argument where the options are not valid.
  explicit FusionMapper(const FusionMapperOptions& options);
  ~FusionMapper();

  /// @return the camera's index. Cameras are known before the first keyframe is mapped.
  /// @throws std::invalid_argument where the calibration is not valid; std::logic_error afterwards.
  int addCamera(const RigCamera& camera);
  /// @throws std::invalid_argument where the pose is not valid, or more than a second older than
  /// the newest.
  void addPose(const StampedPose& pose);
  /// @param events of one camera. Those that come up to 10 ms after a newer one are sorted and
  /// counted.
  /// @throws std::invalid_argument where one comes later than that, or lies outside the sensor:
  /// nothing of this call is taken then.
  void addEvents(int camera, const std::vector<Event>& events);
  /// Says that all of a camera's events before `t_ns` (its own clock) have been added: a camera
  /// that sees nothing does not hold the others up. Without it, a camera's events are known to be
  /// complete until 10 ms before its newest, and one that is a second behind where the others'
  /// newest packets begin is taken to be silent.
  void coverUntil(int camera, std::int64_t t_ns);
  /// No more data will come: windows that are not full by now never will be.
  void finish();

  /// Maps the next window that is covered, if there is one. Costs the keyframe's whole work.
  std::optional<KeyframeDepthMap> next(DsiSink* sink = nullptr, StageHook* stages = nullptr);

  /// Complete once `finish` was called and `next` gave nothing.
  const MapperCounts& counts() const { return counts_; }
  const Rig& rig() const { return rig_; }
  const Trajectory& trajectory() const { return trajectory_; }

 private:
  class SoFar;

  std::int64_t completeNs() const;
  std::size_t countBefore(std::int64_t t_ns) const;
  KeyframeMapper& keyframeMapper();
  bool selected(int camera) const;
  std::int64_t completeUntil(std::size_t camera) const;
  bool camerasCover(std::int64_t t_ns) const;
  void releaseFiltered();
  bool isDue(const Window& window) const;
  void findStart();
  void passEmptyWindows();
  std::vector<EventSpan> eventsOf(const Window& window) const;
  std::optional<KeyframeDepthMap> mapWindow(const Window& window, DsiSink* sink, StageHook* stages);
  void countKeyframe(const KeyframeDepthMap& keyframe);
  std::int64_t settledUntil();
  void settleBefore(std::int64_t t_ns);

  FusionMapperOptions options_;
  Rig rig_;
  Trajectory trajectory_;
  std::unique_ptr<KeyframePolicy> policy_;
  std::unique_ptr<KeyframeMapper> mapper_;  // once the recording starts
  std::vector<EventBuffer> buffers_;        // per camera
  std::vector<FilteredEvents> incoming_;    // per camera, where there is a filter
  std::optional<std::int64_t> start_ns_;    // first event with a pose
  std::optional<std::int64_t> reached_ns_;  // newest event of any camera, selected or not
  std::optional<std::int64_t> begun_ns_;    // where the newest packet of any camera begins
  std::optional<std::int64_t> settled_ns_;  // what is before is counted and gone
  bool finished_ = false;
  MapperCounts counts_;
};

}  // namespace efm
