// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "mapping/geometry/angle.h"
#include "maps/refinement/pose_difference.h"

namespace efm {

/// What one pose errs by on its own: standard deviations on each axis, or how many times as large
/// they are as those of others.
struct PoseNoise {
  double noise_m = 0;
  double noise_rad = 0;
};
inline constexpr PoseNoise kCommonNoise{1, 1};

/// What a tracker's poses err by: each keyframe's on its own, and all of them more and more along
/// the way: as a random walk up to a metre, in proportion to it beyond. All are standard deviations
/// on each axis, 0 to 1e3; the defaults are those of good visual-inertial odometry.
struct TrackerErrors {
  double noise_m = 0.01;
  double noise_rad = 0.5 * kRadiansPerDegree;
  double drift_m = 0.01;  ///< What a metre of way adds.
  double drift_rad = 0.5 * kRadiansPerDegree;

  /// @throws std::invalid_argument naming the field, its value and the allowed range.
  void validate() const;
  /// Of a pose against the one that the tracker would have given without noise. Never singular.
  /// @param times how many times the noise of others it has.
  Matrix6d noiseCovariance(const PoseNoise& times = kCommonNoise) const;
  /// Of the motion without noise over a way in metres. Never singular.
  Matrix6d driftCovariance(double path_length_m) const;
};

/// The motion between two keyframes: the tracker's against the one by their points.
struct MotionSample {
  Vector6d difference = Vector6d::Zero();
  Matrix6d covariance = Matrix6d::Identity();  ///< Of the motion by points. Not singular.
  double path_length_m = 0;                    ///< Between the two.
  PoseNoise from = kCommonNoise;               ///< How many times the noise of others they have.
  PoseNoise to = kCommonNoise;
};

/// The errors that make the samples most likely, of those that are not too far from what was
/// expected: noise within ten times, drift within twice as much or as little, either as one
/// standard deviation. So poses that are exact stay as they are, and those of a tracker that is
/// worse than it says are corrected. Drift is held closer because few samples cannot tell its
/// absence from luck, and a drift that is taken for none bends every loop. A few samples change
/// little. Cost: that of a few hundred 6 x 6 decompositions per sample.
TrackerErrors estimateTrackerErrors(const std::vector<MotionSample>& samples,
                                    const TrackerErrors& expected);

}  // namespace efm
