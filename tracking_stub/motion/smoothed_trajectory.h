// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <vector>

#include "mapping/geometry/trajectory.h"
#include "tracking_stub/motion/motion.h"

namespace efm {

struct SmoothingOptions {
  /// What is faster is cut, Hz, above 0. Lower where the poses come too seldom to know it: at 0.4
  /// of their rate, for above half of it there is nothing but the corners of interpolation.
  double cutoff_hz = 10;
  std::int64_t period_ns = 5'000'000;  ///< Of the result; at most a quarter of 1 / cutoff.
  double max_gap_s = 1;                ///< Longer ones cannot be bridged.

  /// @throws std::invalid_argument naming the field, its value and the allowed range.
  void validate() const;
};

/// Makes a motion of measured poses. Single poses that jump (farther off the line between their
/// neighbours than 8 times what is usual there) are left out, gaps bridged, and what remains is
/// resampled evenly and filtered without delay: a windowed sinc, on positions and, in the tangent
/// space at each sample, on rotations. Poses may be in any order; of equal times the first stands.
/// @throws std::invalid_argument where there are fewer than two poses, or naming a gap.
std::vector<StampedPose> smoothTrajectory(const std::vector<StampedPose>& poses,
                                          const SmoothingOptions& options = {});

/// When a recording gets under way: the first time from which, over half a second, it moves at
/// half its mean speed or more; its beginning where it never moves.
/// @param poses in order of time, at least one.
std::int64_t departureOf(const std::vector<StampedPose>& poses);

/// The motion through evenly spaced poses: linear in position, slerp in rotation, at rest before
/// the first and after the last.
class SampledMotion : public Motion {
 public:
  /// @throws std::invalid_argument where there are fewer than two poses, or they are not evenly
  /// spaced.
  explicit SampledMotion(std::vector<StampedPose> poses);
  Rigid3 poseAt(std::int64_t t_ns) const override;

 private:
  std::vector<StampedPose> poses_;
  std::int64_t period_ns_;
};

}  // namespace efm
