// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <utility>
#include <vector>

#include "mapping/events/event_buffer.h"
#include "mapping/events/event_filter.h"

namespace efm {

/// One camera's events on their way through its filter: they wait until all before them are here,
/// so that what is kept depends neither on packets nor on the order in which late events came.
class FilteredEvents {
 public:
  explicit FilteredEvents(EventFilter filter) : filter_(std::move(filter)) {}

  /// @return how many came after a newer one.
  std::uint64_t insert(const std::vector<Event>& events) { return waiting_.insert(events); }
  /// Filters what lies before a time, before which nothing more is to come, and puts what is kept
  /// into the camera's buffer.
  /// @return how many were not kept.
  std::uint64_t release(std::int64_t until_ns, EventBuffer& buffer);

 private:
  EventFilter filter_;
  EventBuffer waiting_;
  std::vector<Event> kept_;  // reused
};

}  // namespace efm
