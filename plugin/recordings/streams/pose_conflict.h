// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "mapping/geometry/trajectory_check.h"

namespace efm {

/// Why the poses of a file or topic are not one trajectory on one clock.
struct PoseConflict : TrajectoryConflict {  // `first` and `second`: in the order of the file
  /// The first pose after the times went back, if the poses differ from earlier ones of the time
  /// that they have again.
  std::optional<std::size_t> back;

  /// Returns the error. @param placeOf returns the place of a pose, by its index: "line 12".
  std::string text(const std::function<std::string(std::size_t)>& placeOf) const;
};

/// Finds a conflict as `TrajectoryCheck` does, over all poses and where the times go back.
/// @param poses in the order of the file. @param takes_lost see `TrajectoryCheck`.
std::optional<PoseConflict> findPoseConflict(const std::vector<StampedPose>& poses,
                                             bool takes_lost = false);

/// @throws std::runtime_error with a conflict of the poses, whose places are their times.
/// @param name name of the poses, for the error.
void requireOneTrajectory(const std::vector<StampedPose>& poses, const std::string& name,
                          bool takes_lost = false);

}  // namespace efm
