// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <vector>

#include "mapping/dsi/vote_counts.h"

namespace efm {

/// What became of one camera's events: distinct events, so read = used + the rest.
struct EventCounts {
  std::uint64_t read = 0;
  std::uint64_t used = 0;            ///< Voted in at least one keyframe.
  std::uint64_t without_pose = 0;    ///< Not used: the trajectory has no pose at its time.
  std::uint64_t outside_window = 0;  ///< Not used: in no window that was mapped.
  std::uint64_t dropped = 0;   ///< Came after its window was closed, or of an unselected camera.
  std::uint64_t filtered = 0;  ///< Left out as noise, whether they have a pose or not.

  EventCounts& operator+=(const EventCounts& other);
};

struct MapperCounts {
  std::vector<EventCounts> cameras;
  std::uint64_t event_uses = 0;  ///< Summed over keyframes, which may overlap.
  VoteCounts votes;
  std::uint64_t keyframes = 0;
  std::uint64_t keyframes_without_pose = 0;  ///< Windows whose reference time had no pose.
  std::uint64_t windows_without_events = 0;  ///< Passed over: no selected camera saw anything.
  std::uint64_t silent_subintervals = 0;     ///< Summed over keyframes, but of silent cameras.
  std::uint64_t sorted_events = 0;           ///< Came after a newer one of their camera.
  std::uint64_t duplicate_poses = 0;

  EventCounts total() const;
};

}  // namespace efm
