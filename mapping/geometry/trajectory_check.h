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
/// Two places alternate if a pose leaps from the place of the pose before it to the place of an
/// earlier pose. A leap is at least 2 cm or 1.1 degrees, over four times as long as the motion at
/// the place, and needs an acceleration over 600 m/s² or 2000 rad/s². Of the leaps of noise and of
/// a shaken camera, few end at an earlier place; of those to single outliers and back, each second
/// one does. At least 8 changes, 5 % of the poses and two thirds of the leaps are a conflict. So up
/// to eight bodies are found, and one that has a pose for each 30 of another one. Poses that repeat
/// an earlier one bit for bit, and the identity, may be those of a tracker that is lost: they can
/// be left out.
class TrajectoryCheck {
 public:
  /// @param takes_lost true if poses as of a lost tracker count: a transform has two publishers.
  explicit TrajectoryCheck(bool takes_lost = false) : takes_lost_(takes_lost) {}

  /// @param pose not earlier than the pose before it.
  void add(const StampedPose& pose);

  /// Returns the conflict of the poses so far.
  std::optional<TrajectoryConflict> conflict() const;

 private:
  void compareWithSameTime(const StampedPose& pose);
  void lookForChange(const StampedPose& pose);

  bool isLost(const StampedPose& pose);

  bool takes_lost_;
  std::deque<StampedPose> last_;  // the newest poses, the newest last
  std::size_t last_number_ = 0;   // of the newest of them
  Rigid3 lost_;                   // the pose of a lost tracker
  double last_change_ = 0;        // its distance
  std::uint64_t leaps_ = 0;
  StampedPose of_time_;  // the first pose of the newest time
  std::size_t of_time_number_ = 0;
  bool differs_ = false;  // another pose of the newest time differs from it
  TrajectoryConflict equal_times_{true};
  TrajectoryConflict changes_;
};

}  // namespace efm
