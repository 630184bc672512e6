// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "mapping/events/event.h"
#include "mapping/events/event_fate.h"
#include "mapping/events/event_filter.h"
#include "mapping/events/window.h"
#include "mapping/geometry/rig.h"
#include "mapping/geometry/timestamp.h"
#include "mapping/geometry/trajectory.h"

namespace efm {

/// One camera's events from their arrival to their release: checks, filters and buffers them, and
/// counts what becomes of each. Times are on the trajectory's clock: the camera's offset is added.
class CameraStream {
 public:
  /// @param selected whether the camera's events take part.
  /// @param outside_lens `UndistortionTable::outsideLens`; empty for a camera that takes no part.
  CameraStream(int index, const RigCamera& camera, bool selected, std::vector<bool> outside_lens,
               const EventFilterOptions& filter);

  /// @throws std::invalid_argument where an event lies outside the sensor, or comes more than 10 ms
  /// after a newer one.
  void requireValid(EventSpan events) const;
  /// See FusionMapper::isOlder.
  bool isOlder(const std::vector<Event>& events) const;
  /// See FusionMapper::dropLate.
  std::uint64_t dropLate(std::vector<Event>& events);
  /// Adds valid events to the filter, or to the buffer if there is no filter. Events before
  /// `released_ns`, outside the limits and outside the lens are counted, and not added.
  /// @return the number of events that came after a newer one.
  std::uint64_t add(std::vector<Event> events, const TimeLimits& limits, std::int64_t released_ns);
  /// All events before `t_ns` (the camera's own clock) have been added.
  void coverUntil(std::int64_t t_ns);
  /// Filters the events before a time and moves the others to the buffer. No event before this time
  /// may be added afterwards.
  void filterUntil(std::int64_t t_ns) {
    if (filter_) counts_[EventFate::kFiltered] += filter_->release(t_ns, buffer_);
  }

  bool selected() const { return selected_; }
  std::int64_t onTrajectoryClock(std::int64_t t_ns) const { return t_ns + time_offset_ns_; }
  std::optional<std::int64_t> newestNs() const { return newest_ns_; }
  /// All events before this time have been added.
  std::int64_t coveredNs() const { return covered_ns_; }
  const EventCounts& counts() const { return counts_; }

  EventSpan between(std::int64_t t0_ns, std::int64_t t1_ns) const {
    return buffer_.between(t0_ns, t1_ns);
  }
  /// The number of buffered events before a time.
  std::size_t countBefore(std::int64_t t_ns) const { return buffer_.indexOf(t_ns) - buffer_.begin; }
  /// Events that are held, filtered or not.
  std::size_t heldEvents() const {
    return buffer_.events.size() - buffer_.begin + (filter_ ? filter_->waiting() : 0);
  }
  /// Time of the first buffered event at or after a time.
  std::optional<std::int64_t> firstFrom(std::int64_t t_ns) const;
  /// Time of the first buffered event before `until_ns` with a pose.
  std::optional<std::int64_t> firstWithPose(const Trajectory& trajectory, std::int64_t until_ns);
  /// Time of the last buffered event before `until_ns` with a pose.
  std::optional<std::int64_t> lastWithPose(const Trajectory& trajectory, std::int64_t until_ns);
  /// Marks the window's events that have a pose as used; those of an `EvenChoice` of at most
  /// `max_events`.
  void markUsed(const Window& window, const Trajectory& trajectory, std::size_t max_events);
  /// Drops the windows in [t0, t1): their events that no other window uses count as dropped.
  void dropWindows(std::int64_t t0_ns, std::int64_t t1_ns);
  /// Counts and releases the events before a time.
  void release(std::int64_t until_ns, const Trajectory& trajectory);

 private:
  std::int64_t lateBefore() const;

  int index_;
  CameraModel model_;
  std::int64_t time_offset_ns_;
  bool selected_;
  std::vector<bool> outside_lens_;
  std::optional<FilteredEvents> filter_;
  EventBuffer buffer_;
  std::vector<Window> over_budget_;  // windows with events that were not chosen
  std::vector<Window> dropped_;      // times of windows that were dropped, in order
  std::size_t pose_cursor_ = 0;
  std::optional<std::int64_t> newest_ns_;
  std::int64_t covered_ns_ = kMinTimeNs;
  EventCounts counts_;
};

}  // namespace efm
