// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <optional>
#include <vector>

#include "mapping/geometry/trajectory.h"

namespace efm {

/// Distance or speed of a rig: translation in metres and rotation in radians, or both per second.
struct MotionAmount {
  double m = 0;
  double rad = 0;

  MotionAmount operator*(double factor) const { return {factor * m, factor * rad}; }
  /// Returns the largest motion of points at 1 m on the unit image plane.
  double sum() const { return m + rad; }
};

/// Time between two poses. The structs below add a property of this time.
struct PoseSpan {
  std::int64_t t0_ns = 0;
  std::int64_t t1_ns = 0;
};

/// Two consecutive poses whose speed differs from the speed before and after.
struct PoseStep : PoseSpan {
  double deviation = -1;  ///< Difference, m/s or rad/s; below 0: no step.
};

/// Two consecutive poses over 0.1 s apart.
struct PoseGap : PoseSpan {
  MotionAmount moved;
  /// Deviation of the motion from a straight one. From the speeds before and after the gap: |v1 -
  /// v0| * t / 8, exact for a constant acceleration; or half of a jump.
  MotionAmount missed;
};

/// Consecutive poses that are equal bit for bit.
struct PoseHold : PoseSpan {
  MotionAmount speed;        ///< The larger one of the speeds before and after.
  bool speed_after = false;  ///< True if `speed` is the speed after the hold.
};

/// Returns whether a hold may be a rest of the rig. Shorter holds are motion at mean speed.
bool isRest(const PoseHold& hold);

/// Motion of a tracker's poses: irregular steps, gaps, and repeated poses. Memory is constant: time
/// is divided into bins, and each bin keeps its largest values. If there are too many bins, they
/// become twice as long.
class PoseMotion {
 public:
  struct Bin {
    PoseStep step_m;    ///< The step with the largest deviation of translation.
    PoseStep step_rad;  ///< The step with the largest deviation of rotation.
    PoseGap gap;        ///< The gap with the largest missed motion.
    PoseHold hold;      ///< The longest hold.
  };

  /// @param pose must be later than all earlier poses.
  void add(const StampedPose& pose);
  /// Returns a copy that has evaluated the last poses, too: they wait for poses after them.
  PoseMotion completed() const;

  /// Returns the bins in the order of time; some may be empty.
  const std::vector<Bin>& bins() const { return bins_; }
  /// Returns the mean speed without rests.
  MotionAmount meanSpeed() const;

 private:
  void look(std::size_t step);
  void lookAtGap(std::size_t step);
  void lookAtHold(std::size_t step);
  Bin& binAt(std::int64_t t_ns);

  std::deque<StampedPose> poses_;  // poses within a short time around the step `next_`
  std::size_t next_ = 0;  // index in poses_: the step after this pose is the next to evaluate
  std::optional<PoseHold> hold_;  // the current one
  std::vector<Bin> bins_;
  std::int64_t start_ns_ = 0;
  std::int64_t bin_ns_ = 10'000'000;
  MotionAmount path_;
  double moving_s_ = 0;
};

}  // namespace efm
