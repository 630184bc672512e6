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

/// How far or how fast a rig moves: translation in metres, rotation in radians; or both per second.
struct MotionAmount {
  double m = 0;
  double rad = 0;

  MotionAmount operator*(double factor) const { return {factor * m, factor * rad}; }
  /// The motion of points at 1 m on the unit image plane, at most.
  double sum() const { return m + rad; }
};

/// A time between two poses, and something about it: each struct below says what.
struct PoseSpan {
  std::int64_t t0_ns = 0;
  std::int64_t t1_ns = 0;
};

/// Two consecutive poses: by how much the speed between them differs from that before and after.
struct PoseStep : PoseSpan {
  double deviation = -1;  ///< m/s or rad/s; below 0: there is no step.
};

/// Two consecutive poses over 0.1 s apart.
struct PoseGap : PoseSpan {
  MotionAmount moved;
  /// By how much the motion deviates from the straight one in between. Of the speeds before and
  /// after: |v1 - v0| * t / 8, exact where the acceleration is constant; or half of a jump.
  MotionAmount missed;
};

/// Consecutive poses that are the same bit for bit.
struct PoseHold : PoseSpan {
  MotionAmount speed;        ///< Before or after it: the larger one.
  bool speed_after = false;  ///< Which of both it is.
};

/// Whether a hold may be a rest of the rig: over shorter ones, its mean speed counts.
bool isRest(const PoseHold& hold);

/// How a tracker's poses move: its irregular steps, its gaps, and its poses that repeat. Memory is
/// constant: time is divided into bins, which become twice as long where they are too many, and
/// each keeps its largest values.
class PoseMotion {
 public:
  struct Bin {
    PoseStep step_m;    ///< The largest deviation of a translation.
    PoseStep step_rad;  ///< The largest deviation of a rotation.
    PoseGap gap;        ///< The one with the most motion missed.
    PoseHold hold;      ///< The longest one.
  };

  /// @param pose later than all before it.
  void add(const StampedPose& pose);
  /// What was added, with the last poses: these wait for those that may come after them.
  PoseMotion completed() const;

  /// In the order of time; empty ones are among them.
  const std::vector<Bin>& bins() const { return bins_; }
  /// The mean speed without rests.
  MotionAmount meanSpeed() const;

 private:
  void look(std::size_t step);
  void lookAtGap(std::size_t step);
  void lookAtHold(std::size_t step);
  Bin& binAt(std::int64_t t_ns);

  std::deque<StampedPose> poses_;  // a short time around the step `next_`
  std::size_t next_ = 0;           // of poses_: the step to the one after it was not looked at yet
  std::optional<PoseHold> hold_;   // until now
  std::vector<Bin> bins_;
  std::int64_t start_ns_ = 0;
  std::int64_t bin_ns_ = 10'000'000;
  MotionAmount path_;
  double moving_s_ = 0;
};

}  // namespace efm
