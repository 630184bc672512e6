// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

#include "mapping/geometry/rigid3.h"

namespace efm {

/// Where the rig was at one instant.
struct StampedPose {
  std::int64_t t_ns = 0;
  Rigid3 T_world_rig;
};

struct TrajectoryOptions {
  /// Two neighbouring poses further apart than this say nothing about the time between them.
  /// Range: above 0. Real recordings have gaps up to 0.13 s that are still well interpolated.
  double max_pose_gap_s = 0.25;

  /// @throws std::invalid_argument naming the field, its value and the allowed range.
  void validate() const;
};

/// A stretch of time in which the motion is one linear (and one slerp) piece. Both ends belong to
/// it; where a single pose stands alone they coincide.
struct TrajectorySegment {
  StampedPose first;
  StampedPose last;

  /// The pose at a time inside the segment.
  Rigid3 poseAt(std::int64_t t_ns) const;
};

/// The rig's motion: poses in time order, linear in position and slerp in rotation between them.
/// Never extrapolates. Not thread-safe while poses are added; queries are const.
class Trajectory {
 public:
  explicit Trajectory(const TrajectoryOptions& options = {});

  /// Takes a pose, in any order of time; cost is constant for the newest. Of two poses with the
  /// same time the first stands. @return false where the pose was such a duplicate.
  /// @throws std::invalid_argument where the pose is not finite, its rotation has no length, or its
  /// time lies beyond kEndOfTimeNs.
  bool add(const StampedPose& pose);

  /// May forget what is not needed for times from `t_ns` on; cost is constant on average.
  void forgetBefore(std::int64_t t_ns);

  /// T_world_rig, or nothing outside the recorded times and inside a gap. A time that a pose was
  /// recorded at has that pose, whatever surrounds it.
  std::optional<Rigid3> poseAt(std::int64_t t_ns) const;

  /// The segment that holds `t_ns`; at a recorded time the one that begins there, if there is one.
  /// `cursor` is any number at first and then what the previous call left: neighbouring queries
  /// cost no search.
  std::optional<TrajectorySegment> segmentAt(std::int64_t t_ns, std::size_t& cursor) const;

  /// The poses that matter from one time to another, each put where `T_world_moved` says; gaps stay
  /// gaps.
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
