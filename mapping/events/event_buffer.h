// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "mapping/events/event.h"

namespace efm {

/// One camera's events that a window may still need, in time order.
struct EventBuffer {
  std::vector<Event> events;
  std::vector<bool> used;  ///< Parallel to `events`: the event voted in a keyframe.
  std::size_t begin = 0;   ///< Events before this index are released.

  /// Index of the first event at or after a time.
  std::size_t indexOf(std::int64_t t_ns) const;
  /// The events of [t0, t1). Valid until the buffer changes.
  EventSpan between(std::int64_t t0_ns, std::int64_t t1_ns) const {
    return EventSpan(events).part(indexOf(t0_ns), indexOf(t1_ns));
  }
  /// Inserts events, each after others of the same time. Cost: linear for events in time order;
  /// otherwise that of sorting the events after the earliest late one.
  /// @return the number of events that came after a newer one.
  /// @throws std::bad_alloc without a change.
  std::uint64_t insert(EventSpan added);
  /// Forgets the events from an index on.
  void cut(std::size_t index) {
    events.resize(index);
    used.resize(index);
  }
  /// Frees the memory of released events; cost is constant on average.
  void compact();

 private:
  void sortFrom(std::size_t index);
};

}  // namespace efm
