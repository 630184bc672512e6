// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "mapping/events/event.h"
#include "mapping/geometry/timestamp.h"

namespace efm {

/// One camera's events that a window may still need, in time order, and what became of each.
struct EventBuffer {
  std::vector<Event> events;
  std::vector<char> used;  ///< Beside `events`: voted in a keyframe.
  std::size_t begin = 0;   ///< What is before is forgotten.
  std::size_t pose_cursor = 0;
  std::optional<std::int64_t> newest_ns;  ///< Of all events that were added.
  /// Everything before this time is here.
  std::int64_t covered_ns = kMinTimeNs;

  /// Index of the first event at or after a time.
  std::size_t indexOf(std::int64_t t_ns) const;
  /// The events of [t0, t1). Valid until the buffer changes.
  EventSpan between(std::int64_t t0_ns, std::int64_t t1_ns) const {
    return EventSpan(events).part(indexOf(t0_ns), indexOf(t1_ns));
  }
  void coverUntil(std::int64_t t_ns);
  /// Puts events in their places, after others of the same time. Cost: linear where they are in
  /// time order, otherwise that of sorting what lies behind the earliest of them.
  /// @return how many came after a newer one.
  std::uint64_t insert(const std::vector<Event>& added);
  /// Gives back the memory of what is forgotten; cost is constant on average.
  void compact();

 private:
  std::size_t indexOfUnsorted(std::int64_t t_ns, std::size_t end) const;
  void sortFrom(std::size_t index);
};

}  // namespace efm
