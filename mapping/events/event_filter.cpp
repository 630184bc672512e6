// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/events/event_filter.h"

#include <algorithm>

#include "mapping/base/option_check.h"
#include "mapping/geometry/timestamp.h"

namespace efm {

void EventFilterOptions::validate() const {
  hot_pixel.validate();
  // Time has a resolution of a nanosecond.
  requireOption(
      background_activity_s == 0 || (background_activity_s >= 1e-9 && background_activity_s <= 10),
      "background_activity_s", background_activity_s, "0, or from 1e-9 to 10 (seconds)");
}

EventFilter::EventFilter(int width, int height, const EventFilterOptions& options) {
  options.validate();
  if (options.hot_pixels) hot_pixels_.emplace(width, height, options.hot_pixel);
  if (options.background_activity_s > 0) {
    background_activity_.emplace(width, height, durationFromSeconds(options.background_activity_s));
  }
}

std::uint64_t FilteredEvents::release(std::int64_t until_ns, EventBuffer& buffer) {
  const std::size_t end = waiting_.indexOf(until_ns);
  const std::size_t released = end - waiting_.begin;
  if (released == 0) return 0;
  const auto at = [&](std::size_t i) {
    return waiting_.events.begin() + static_cast<std::ptrdiff_t>(i);
  };
  const auto last = std::remove_if(at(waiting_.begin), at(end),
                                   [&](const Event& event) { return !filter_.keeps(event); });
  const auto kept = static_cast<std::size_t>(last - at(waiting_.begin));
  if (buffer.begin == buffer.events.size() && kept > buffer.events.capacity()) {
    // After a wait the memory changes hands: a copy would hold all events twice.
    const std::vector<Event> rest(at(end), waiting_.events.end());
    waiting_.cut(waiting_.begin + kept);
    buffer = std::exchange(waiting_, {});
    waiting_.insert(rest);
  } else {
    buffer.insert({&*at(waiting_.begin), &*at(waiting_.begin) + kept});
    waiting_.begin = end;
    waiting_.compact();
  }
  return released - kept;
}

}  // namespace efm
