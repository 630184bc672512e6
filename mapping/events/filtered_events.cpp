// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/events/filtered_events.h"

namespace efm {

std::uint64_t FilteredEvents::release(std::int64_t until_ns, EventBuffer& buffer) {
  const std::size_t end = waiting_.indexOf(until_ns);
  const std::size_t released = end - waiting_.begin;
  if (released == 0) return 0;
  kept_.resize(released);
  std::size_t kept = 0;
  for (std::size_t i = waiting_.begin; i < end; ++i) {
    kept_[kept] = waiting_.events[i];
    if (filter_.keeps(kept_[kept])) ++kept;
  }
  kept_.resize(kept);
  waiting_.begin = end;
  waiting_.compact();
  buffer.insert(kept_);
  return released - kept_.size();
}

}  // namespace efm
