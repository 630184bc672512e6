// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/event_buffer.h"

#include <algorithm>

namespace efm {

std::size_t EventBuffer::indexOf(std::int64_t t_ns) const {
  const auto first =
      std::lower_bound(events.begin() + static_cast<std::ptrdiff_t>(begin), events.end(), t_ns,
                       [](const Event& event, std::int64_t time) { return event.t_ns < time; });
  return static_cast<std::size_t>(first - events.begin());
}

void EventBuffer::coverUntil(std::int64_t t_ns) { covered_ns = std::max(covered_ns, t_ns); }

bool EventBuffer::insert(const Event& event) {
  if (begin == events.size() || events.back().t_ns <= event.t_ns) {
    events.push_back(event);
    used.push_back(0);
    return false;
  }
  const auto at = std::upper_bound(
      events.begin() + static_cast<std::ptrdiff_t>(begin), events.end(), event.t_ns,
      [](std::int64_t t_ns, const Event& other) { return t_ns < other.t_ns; });
  used.insert(used.begin() + (at - events.begin()), 0);
  events.insert(at, event);
  return true;
}

void EventBuffer::compact() {
  if (begin < events.size() / 2) return;
  const auto count = static_cast<std::ptrdiff_t>(begin);
  events.erase(events.begin(), events.begin() + count);
  used.erase(used.begin(), used.begin() + count);
  begin = 0;
}

}  // namespace efm
