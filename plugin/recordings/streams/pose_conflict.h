// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "mapping/base/text.h"
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

/// Finds the poses of a file or topic whose times are wrong. Like wrong times of events they come
/// in bursts.
///
/// The rule: the longest sequence of poses whose times do not go back is right. Of the others,
/// poses in a row, without a leap of a second between them, are wrong if they span less than a
/// second, the times leap before them and leap back after them, and they mostly differ from the
/// motion of the right ones at their times, or lie over a second before or after all right ones.
/// The rest came late only. If over a third of the poses are out of order, the file has another
/// order, and no pose is wrong.
/// @param poses in the order of the file. @return their indices.
std::vector<std::size_t> findWrongTimes(const std::vector<StampedPose>& poses);

/// Removes the items at these rising indices.
template <typename Item>
void removeAt(const std::vector<std::size_t>& indices, std::vector<Item>& items) {
  auto next = indices.begin();
  std::size_t kept = 0;
  for (std::size_t i = 0; i < items.size(); ++i) {
    if (next != indices.end() && *next == i) {
      ++next;
    } else if (kept++ != i) {
      items[kept - 1] = std::move(items[i]);
    }
  }
  items.erase(items.begin() + static_cast<std::ptrdiff_t>(kept), items.end());
}

/// Returns the warning about poses that were left out. @param first what is wrong with the first.
Warning skippedPoses(std::uint64_t count, const std::string& first);

/// Leaves out the poses with wrong times, and warns of them. @return their indices.
/// @throws std::runtime_error with a conflict of the poses, whose places are their times.
/// @param name name of the poses, for the error.
std::vector<std::size_t> takeOneTrajectory(std::vector<StampedPose>& poses, const std::string& name,
                                           std::vector<Warning>& warnings, bool takes_lost = false);

}  // namespace efm
