// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/events/event_buffer.h"

#include <algorithm>
#include <utility>

#include "mapping/geometry/timestamp.h"

namespace efm {

std::size_t EventBuffer::indexOf(std::int64_t t_ns) const {
  const auto first =
      std::lower_bound(events.begin() + static_cast<std::ptrdiff_t>(begin), events.end(), t_ns,
                       [](const Event& event, std::int64_t time) { return event.t_ns < time; });
  return static_cast<std::size_t>(first - events.begin());
}

std::uint64_t EventBuffer::insert(EventSpan added) {
  std::int64_t newest = begin < events.size() ? events.back().t_ns : kMinTimeNs;
  std::int64_t earliest_late = kMaxTimeNs;
  std::uint64_t late = 0;
  for (const Event& event : added) {
    if (event.t_ns < newest) {
      ++late;
      earliest_late = std::min(earliest_late, event.t_ns);
    }
    newest = std::max(newest, event.t_ns);
  }
  // Times are whole: the first event later than the earliest late one. The old events are sorted.
  const std::size_t first_unsorted = late > 0 ? indexOf(earliest_late + 1) : 0;
  const std::size_t before = events.size();
  try {
    events.insert(events.end(), added.begin(), added.end());
    used.resize(events.size());
    if (late > 0) sortFrom(first_unsorted);
  } catch (...) {  // no memory
    events.resize(before);
    used.resize(before);
    throw;
  }
  return late;
}

void EventBuffer::sortFrom(std::size_t index) {
  std::vector<std::pair<Event, bool>> tail;
  for (std::size_t i = index; i < events.size(); ++i) tail.emplace_back(events[i], used[i]);
  std::stable_sort(tail.begin(), tail.end(),
                   [](const auto& a, const auto& b) { return a.first.t_ns < b.first.t_ns; });
  for (const auto& [event, was_used] : tail) {
    events[index] = event;
    used[index++] = was_used;
  }
}

void EventBuffer::compact() {
  if (begin < events.size() / 2) return;
  const auto count = static_cast<std::ptrdiff_t>(begin);
  events.erase(events.begin(), events.begin() + count);
  used.erase(used.begin(), used.begin() + count);
  begin = 0;
}

}  // namespace efm
