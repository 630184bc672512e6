// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "mapping/geometry/trajectory.h"
#include "mapping/geometry/trajectory_check.h"

namespace efm {

/// Why the poses of a file or topic are not one trajectory on one clock.
struct PoseConflict {
  enum class Kind {
    kOneTime,     ///< All poses have the same time.
    kEqualTimes,  ///< Poses of one time differ.
    kTwoPlaces,   ///< Poses alternate between two places.
    kBackward,    ///< Times go back, and the poses there differ from the earlier ones.
  };
  Kind kind = Kind::kOneTime;
  std::size_t first = 0, second = 0;  ///< The first two poses that contradict each other.
  std::size_t back = 0;               ///< kBackward: the first pose after the times went back.
  double distance_m = 0, angle_rad = 0;

  /// Returns the error. @param placeOf returns the place of a pose, by its index: "line 12".
  std::string text(const std::function<std::string(std::size_t)>& placeOf) const;

  std::string counts = {};  ///< "480 of 500"
};

/// Finds a conflict as `TrajectoryCheck` does, and in the time that poses of a file have again
/// after their times went back.
/// @param poses in the order of the file.
std::optional<PoseConflict> findPoseConflict(const std::vector<StampedPose>& poses);

/// @throws std::runtime_error with a conflict of the poses, whose places are their times.
/// @param name name of the poses, for the error.
void requireOneTrajectory(const std::vector<StampedPose>& poses, const std::string& name);

}  // namespace efm
