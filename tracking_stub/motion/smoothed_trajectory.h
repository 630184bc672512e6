// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <vector>

#include "mapping/geometry/trajectory.h"
#include "tracking_stub/motion/motion.h"

namespace efm {

struct SmoothingOptions {
  /// Cutoff frequency of the low-pass filter, Hz, above 0. At most 0.4 times the rate of the poses
  /// is used: above half of that rate there are only artefacts of interpolation.
  double cutoff_hz = 10;
  std::int64_t period_ns = 5'000'000;  ///< Of the result; at most a quarter of 1 / cutoff.
  double max_gap_s = 1;                ///< Longer gaps are errors.

  /// @throws std::invalid_argument naming the field, its value and the allowed range.
  void validate() const;
};

/// Smooths measured poses. A single pose that jumps is removed: its distance from the line between
/// its neighbours is over 8 times the median. The others are resampled evenly, also across gaps,
/// and filtered without delay by a windowed sinc: positions, and rotations in the tangent space at
/// each sample. Poses may be in any order; of equal times the first counts.
/// @throws std::invalid_argument where there are fewer than two poses, or naming a gap.
std::vector<StampedPose> smoothTrajectory(const std::vector<StampedPose>& poses,
                                          const SmoothingOptions& options = {});

/// The first time from which a recording moves, over half a second, with at least half of its mean
/// speed. The time of the first pose where it never moves.
/// @param poses in order of time, at least one.
std::int64_t startOfMotion(const std::vector<StampedPose>& poses);

/// The motion through evenly spaced poses: linear in position, slerp in rotation, and at rest
/// before the first pose and after the last.
class SampledMotion : public Motion {
 public:
  /// @throws std::invalid_argument where there are fewer than two poses or uneven periods.
  explicit SampledMotion(std::vector<StampedPose> poses);
  Rigid3 poseAt(std::int64_t t_ns) const override;

 private:
  std::vector<StampedPose> poses_;
  std::int64_t period_ns_;
};

}  // namespace efm
