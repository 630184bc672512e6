// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>

#include <cstddef>
#include <cstdint>
#include <string>

#include "mapping/base/option.h"
#include "mapping/geometry/rigid3.h"

namespace efm {

/// The noise of one pose as a ratio to the expected noise of the tracker: without a unit, 1 if the
/// tracker states nothing.
struct NoiseScale {
  double translation = 1;
  double rotation = 1;
};

/// The errors of the poses of a tracker: noise, independent for each keyframe, and drift, which
/// grows along the path: as a random walk up to one metre, in proportion to the path length beyond.
/// All are standard deviations on each axis, 0 to 1e3. The defaults are those of good
/// visual-inertial odometry.
struct TrackerErrors {
  double noise_m = 0.01;
  double noise_rad = 0.5 * kRadiansPerDegree;
  double drift_m = 0.01;  ///< Per metre of path.
  double drift_rad = 0.5 * kRadiansPerDegree;

  template <typename Self, typename Visit>
  static void fields(Self& self, Visit&& visit) {
    const Allowed range = Allowed::from(0, 1000, "from 0 to 1000");
    visit("tracker_noise_m", self.noise_m, range);
    visit("tracker_noise_deg", self.noise_rad, range.in(kRadiansPerDegree));
    visit("tracker_drift", self.drift_m, range);
    visit("tracker_drift_deg_per_m", self.drift_rad, range.in(kRadiansPerDegree));
  }
  void validate() const { requireFields(*this); }
  /// Returns the covariance of a pose relative to the pose without noise. Never singular.
  Matrix6d noiseCovariance(const NoiseScale& scale = {}) const;
  /// Returns the covariance of the motion without noise along a path. Never singular.
  Matrix6d driftCovariance(double path_length_m) const;
};

struct RefinementCounts {
  std::uint64_t registered = 0;     ///< Keyframes that were registered with earlier ones.
  std::uint64_t loop_checks = 0;    ///< Candidates that were registered.
  std::uint64_t loops = 0;          ///< Candidates that became factors.
  std::uint64_t loops_dropped = 0;  ///< Loops that other factors contradicted.
  std::uint64_t failed_solves = 0;  ///< Failed solves: the poses stayed.
};

/// State of a refinement so far.
struct RefinementState {
  Rigid3 T_world_odom;          ///< Maps the tracker's newest poses to the refined world.
  Rigid3 T_world_ref_denoised;  ///< Pose of the newest keyframe, without its noise.
  Matrix6d covariance = Matrix6d::Zero();  ///< Covariance of a pose there: see KeyframeRefiner.
  RefinementCounts counts;
  TrackerErrors tracker;    ///< Estimated errors of the tracker.
  std::size_t waiting = 0;  ///< Number of keyframes that are not refined yet.
  /// Number of errors so far. If its refinement fails, a keyframe keeps the tracker's motion.
  std::uint64_t failures = 0;
  std::string last_error;   ///< Text of the last error; empty without errors.
  double seconds = 0;       ///< Time spent refining.
  double cpu_seconds = 0;   ///< Processor time spent refining.
  double most_seconds = 0;  ///< Longest time spent on one keyframe.
};

}  // namespace efm
