// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <vector>

#include "mapping/event_span.h"

namespace efm {

/// One camera's events that a window may still need, in time order, and what became of each.
struct EventBuffer {
  std::vector<Event> events;
  std::vector<char> used;  ///< Beside `events`: voted in a keyframe.
  std::size_t begin = 0;   ///< What is before is forgotten.
  std::size_t pose_cursor = 0;
  std::optional<std::int64_t> newest_ns;  ///< Of all events that were added.
  /// Everything before this time is here.
  std::int64_t covered_ns = std::numeric_limits<std::int64_t>::min();

  /// Index of the first event at or after a time.
  std::size_t indexOf(std::int64_t t_ns) const;
  /// The events of [t0, t1). Valid until the buffer changes.
  EventSpan between(std::int64_t t0_ns, std::int64_t t1_ns) const {
    return EventSpan(events).part(indexOf(t0_ns), indexOf(t1_ns));
  }
  void coverUntil(std::int64_t t_ns);
  /// Puts an event in its place. @return whether a newer one had come before.
  bool insert(const Event& event);
  /// Gives back the memory of what is forgotten; cost is constant on average.
  void compact();
};

}  // namespace efm
