// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/keyframes/mapper_counts.h"

namespace efm {

EventCounts& EventCounts::operator+=(const EventCounts& other) {
  read += other.read;
  used += other.used;
  without_pose += other.without_pose;
  outside_window += other.outside_window;
  filtered += other.filtered;
  dropped += other.dropped;
  return *this;
}

EventCounts MapperCounts::total() const {
  EventCounts sum;
  for (const EventCounts& camera : cameras) sum += camera;
  return sum;
}

}  // namespace efm
