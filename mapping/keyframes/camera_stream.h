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

/// Buffer of one camera's events from arrival to release. It filters events, and counts each by its
/// fate. Times are on the trajectory's clock: the camera's offset is added.
class CameraStream {
 public:
  /// @param selected whether the camera's events take part.
  /// @param outside_lens `UndistortionTable::outsideLens`; empty for a camera that takes no part.
  CameraStream(int index, const RigCamera& camera, bool selected, std::vector<bool> outside_lens,
               const EventFilterOptions& filter);

  /// @throws std::invalid_argument if the packet begins over 10 ms before the newest event of
  /// earlier packets, or its times leave the limits of time by the camera's offset.
  void requireNext(const CheckedEvents& packet) const;
  /// Adds valid events to the filter, or to the buffer if there is no filter. Events before
  /// `released_ns`, outside the limits and outside the lens are counted, and not added.
  /// @return the number of events that came after a newer event.
  std::uint64_t add(std::vector<Event> events, const TimeLimits& limits, std::int64_t released_ns);
  /// Declares that all events before `t_ns` (the camera's own clock) have been added.
  void setCompleteUntil(std::int64_t t_ns);
  /// Filters the events before a time and moves the events that pass to the buffer. No event before
  /// this time may be added afterwards.
  void filterUntil(std::int64_t t_ns) {
    if (filter_) counts_[EventFate::kFiltered] += filter_->release(t_ns, buffer_);
  }

  bool selected() const { return selected_; }
  std::int64_t onTrajectoryClock(std::int64_t t_ns) const { return t_ns + camera_.time_offset_ns; }
  std::optional<std::int64_t> newestNs() const { return newest_ns_; }
  /// Returns the time before which all events have been added.
  std::int64_t completeNs() const { return complete_ns_; }
  const EventCounts& counts() const { return counts_; }

  EventSpan between(std::int64_t t0_ns, std::int64_t t1_ns) const {
    return buffer_.between(t0_ns, t1_ns);
  }
  /// Returns the number of buffered events before a time.
  std::size_t countBefore(std::int64_t t_ns) const { return buffer_.indexOf(t_ns) - buffer_.begin; }
  /// Returns the number of events in the filter and in the buffer.
  std::size_t heldEvents() const {
    return buffer_.events.size() - buffer_.begin + (filter_ ? filter_->waiting() : 0);
  }
  /// Returns the time of the first buffered event at or after a time.
  std::optional<std::int64_t> firstFrom(std::int64_t t_ns) const;
  /// Returns the time of the first buffered event before `until_ns` with a pose.
  std::optional<std::int64_t> firstWithPose(const Trajectory& trajectory, std::int64_t until_ns);
  /// Returns the time of the last buffered event before `until_ns` with a pose.
  std::optional<std::int64_t> lastWithPose(const Trajectory& trajectory, std::int64_t until_ns);
  /// Marks the window's events that have a pose as used. Only events of an `EvenChoice` of at most
  /// `max_events` are marked.
  void markUsed(const Window& window, const Trajectory& trajectory, std::size_t max_events);
  /// Drops the windows in [t0, t1): their events count as dropped unless another window uses them.
  void dropWindows(std::int64_t t0_ns, std::int64_t t1_ns);
  /// Counts and releases the events before a time.
  void release(std::int64_t until_ns, const Trajectory& trajectory);

 private:
  std::int64_t lateBefore() const;

  int index_;
  RigCamera camera_;
  bool selected_;
  std::vector<bool> outside_lens_;
  std::optional<FilteredEvents> filter_;
  EventBuffer buffer_;
  std::vector<Window> over_budget_;             // windows whose events were not all chosen
  std::vector<Window> dropped_;                 // times of windows that were dropped, in order
  std::int64_t dropped_until_ns_ = kMinTimeNs;  // end of the last one of all
  std::size_t pose_cursor_ = 0;
  std::optional<std::int64_t> newest_ns_;
  std::int64_t complete_ns_ = kMinTimeNs;
  EventCounts counts_;
};

}  // namespace efm
