// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

#include "mapping/geometry/rigid3.h"

namespace efm {

/// The rig's pose at one time.
struct StampedPose {
  std::int64_t t_ns = 0;
  Rigid3 T_world_rig;
};

struct TrajectoryOptions {
  /// Between two neighbouring poses with a longer gap there is no pose. Above 0. Real recordings
  /// have gaps up to 0.13 s that interpolation still bridges well.
  double max_pose_gap_s = 0.25;

  /// @throws std::invalid_argument naming the field, its value and the allowed range.
  void validate() const;
};

/// Two neighbouring poses and the closed interval between them; both are the same pose where a pose
/// has a gap after it.
struct TrajectorySegment {
  StampedPose first;
  StampedPose last;

  /// The pose at a time inside the segment.
  Rigid3 poseAt(std::int64_t t_ns) const;
};

/// The rig's motion: poses in time order; between them, linear in position and slerp in rotation.
/// Never extrapolates. Not thread-safe while poses are added; queries are const.
class Trajectory {
 public:
  explicit Trajectory(const TrajectoryOptions& options = {});

  /// Adds a pose at any time; cost is constant for the newest. Of two poses at the same time the
  /// first one stays. @return false for such a duplicate.
  /// @throws std::invalid_argument where the pose is not finite, its quaternion has no length, or
  /// its time lies beyond kEndOfTimeNs.
  bool add(const StampedPose& pose);

  /// May remove poses that times from `t_ns` on do not need; cost is constant on average.
  void forgetBefore(std::int64_t t_ns);

  /// T_world_rig; nothing outside the recorded times and inside a gap. At a recorded time always
  /// the recorded pose.
  std::optional<Rigid3> poseAt(std::int64_t t_ns) const;

  /// The segment that contains `t_ns`; at a recorded time the one that begins there, if there is
  /// one.
  /// @param cursor any number at first; then its value after the previous call, so that nearby
  /// queries need no search.
  std::optional<TrajectorySegment> segmentAt(std::int64_t t_ns, std::size_t& cursor) const;

  /// The poses that [from, to] needs, each replaced by its `T_world_moved`; gaps stay gaps.
  Trajectory moved(std::int64_t from_ns, std::int64_t to_ns,
                   const std::function<Rigid3(const StampedPose&)>& T_world_moved) const;

  bool empty() const { return poses_.empty(); }
  const std::vector<StampedPose>& poses() const { return poses_; }

 private:
  bool isGap(const StampedPose& before, const StampedPose& after) const;

  std::int64_t max_gap_ns_;
  std::vector<StampedPose> poses_;  // strictly increasing times
};

}  // namespace efm
