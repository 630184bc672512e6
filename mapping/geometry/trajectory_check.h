// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <optional>

#include "mapping/geometry/trajectory.h"

namespace efm {

/// Poses of one stream that cannot be poses of one body.
struct TrajectoryConflict {
  bool equal_times = false;  ///< True: poses of one time differ. False: two places alternate.
  std::uint64_t count = 0;   ///< Number of times whose poses differ, or of changes of the place.
  std::uint64_t of = 0;      ///< Number of all times, or of all poses.
  // The first two such poses.
  std::size_t first = 0, second = 0;  ///< Their numbers, in the order of `add`.
  double distance_m = 0;
  double angle_rad = 0;
};

/// Finds the poses of two bodies in one stream. Memory is constant.
///
/// Two poses of one time differ if they are over 1 mm or 0.1 degrees apart. Some trackers repeat a
/// time now and then; at more than 1 % of the times it is a conflict.
///
/// Two places alternate if a pose leaves the place of the pose before it, and returns to the place
/// of an earlier pose. The way is at least 2 cm or 1.1 degrees, over four times as long as the
/// motion at the place, and needs an acceleration over 400 m/s². Jitter, jumps and outliers do not
/// return to one place; a shaken camera has less acceleration. At least 8 changes, and 5 % of the
/// poses, are a conflict. So up to eight bodies are found, and one that has a pose for each 30 of
/// another one.
class TrajectoryCheck {
 public:
  /// @param pose not earlier than the pose before it.
  void add(const StampedPose& pose);

  /// Returns the conflict of the poses so far.
  std::optional<TrajectoryConflict> conflict() const;

 private:
  void compareWithSameTime(const StampedPose& pose);
  void lookForChange(const StampedPose& pose);

  std::deque<StampedPose> last_;  // the newest poses, the newest last
  StampedPose of_time_;           // the first pose of the newest time
  std::size_t of_time_number_ = 0;
  bool differs_ = false;  // another pose of the newest time differs from it
  TrajectoryConflict equal_times_{true};
  TrajectoryConflict changes_;
};

}  // namespace efm
