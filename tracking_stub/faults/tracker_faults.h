// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "mapping/base/option.h"
#include "mapping/geometry/rigid3.h"
#include "mapping/geometry/timestamp.h"
#include "mapping/geometry/trajectory.h"
#include "tracking_stub/faults/tracker_process.h"

namespace efm {

/// Noise that is constant within a time interval, such as the window of a keyframe. Default: none.
///
/// The noise moves all poses of an interval rigidly. The depth map of a window inside the interval
/// does not change. At the begin of each interval, two interpolated poses are inserted: one a tick
/// before the jump and one after it. So interpolation does not carry the jump into an interval.
struct KeyframeNoiseOptions {
  double noise_m = 0;    ///< Standard deviation on each axis.
  double noise_rad = 0;  ///< Standard deviation on each axis.
  /// Length of the intervals. Required if there is noise.
  std::optional<std::int64_t> length_ns;
  /// Start of interval 0. Default: the time of the first pose.
  std::optional<std::int64_t> start_ns;

  bool any() const { return noise_m > 0 || noise_rad > 0; }
};

/// Drift of odometry. Default: none.
///
/// The heading rotates about one axis and the position moves in one direction, both in proportion
/// to the path length so far. Axis and direction are random unit vectors in the world.
struct PoseDriftOptions {
  double fraction = 0;   ///< Drift of the position per path length: metres per metre.
  double rad_per_m = 0;  ///< Rotation of the heading per path length.

  bool any() const { return fraction > 0 || rad_per_m > 0; }
};

/// Errors of a tracker's poses. Default: none.
///
/// Drift, noise per keyframe and noise per pose are added in this order. Each has its own random
/// numbers. Noise per pose is drawn by time stamp: a pose keeps its noise when other poses are
/// lost. Noise of a position is in the world frame; noise of a rotation is about the rig's axes.
struct PosePerturbationOptions {
  /// Independent noise of each pose: standard deviation on each axis.
  double noise_m = 0;    ///< Metres, of the position.
  double noise_rad = 0;  ///< Radians, of the rotation.
  KeyframeNoiseOptions keyframe;
  PoseDriftOptions drift;
  /// Longest gap across which poses are interpolated. See TrajectoryOptions.
  double max_pose_gap_s = TrajectoryOptions().max_pose_gap_s;
  std::int64_t tick_ns = 1;  ///< Time stamps are multiples of this, 1 to 999999.
  std::uint64_t seed = 0;

  bool any() const { return noise_m > 0 || noise_rad > 0 || keyframe.any() || drift.any(); }
};

/// Poses that a tracker loses. Default: none.
struct PoseDropoutOptions {
  double drop_probability = 0;  ///< Probability that a pose is lost.
  double random_gaps_hz = 0;    ///< Random gaps per second of tracking.
  double random_gap_s = 0.5;    ///< Length of a random gap.
  std::uint64_t seed = 0;
};

/// All faults of a tracker. Default: none.
struct TrackerFaults {
  TrackerProcessOptions process;  ///< Comes before the other faults; its seed is theirs.
  PosePerturbationOptions perturbation;
  PoseDropoutOptions dropouts;
  std::int64_t latency_ns = 0;  ///< Time between a pose's stamp and its arrival.

  /// Returns whether poses are moved.
  bool move() const { return process.any() || perturbation.any(); }
  bool any() const {
    return move() || dropouts.drop_probability > 0 || dropouts.random_gaps_hz > 0 || latency_ns > 0;
  }
  /// Visits the keys of `--perturb`, in metres, degrees and seconds. `tick_ns` has no key.
  template <typename Self, typename Visit>
  static void fields(Self& self, Visit&& visit) {
    const Allowed metres = Allowed::from(0, 1000, "a number, 0 to 1000 (metres)");
    const Allowed degrees = Allowed::from(0, 180, "a number, 0 to 180 (degrees)");
    const Allowed seconds = Allowed::from(0.001, 1e6, "a number, 0.001 to 1e6 (seconds)");
    auto& poses = self.perturbation;
    auto& keyframe = poses.keyframe;
    visit("noise_m", poses.noise_m, metres);
    visit("noise_deg", poses.noise_rad, degrees.in(kRadiansPerDegree));
    visit("keyframe_noise_m", keyframe.noise_m, metres);
    visit("keyframe_noise_deg", keyframe.noise_rad, degrees.in(kRadiansPerDegree));
    visit("keyframe_s", keyframe.length_ns, seconds.in(kNanosecondsPerSecond));
    visit("keyframe_start_s", keyframe.start_ns);
    visit("drift", poses.drift.fraction,
          Allowed::from(0, 1, "a number, 0 to 1 (metres per metre)"));
    visit("drift_deg_per_m", poses.drift.rad_per_m,
          Allowed::from(0, 500, "a number, 0 to 500 (degrees per metre)").in(kRadiansPerDegree));
    visit("latency_s", self.latency_ns,
          Allowed::from(0, 10, "a number, 0 to 10 (seconds)").in(kNanosecondsPerSecond));
    visit("drop", self.dropouts.drop_probability,
          Allowed::from(0, 1, "a number, 0 to 1 (the probability of each pose)"));
    visit("gaps_hz", self.dropouts.random_gaps_hz,
          Allowed::from(0, 1000, "a number, 0 to 1000 (gaps per second)"));
    visit("gap_s", self.dropouts.random_gap_s, seconds);
    visit("tracker", self.process.tracker);
    visit("depth_m", self.process.depth_m,
          Allowed::from(0.01, 1e4, "a number, 0.01 to 1e4 (metres)"));
    visit("seed", poses.seed);  // seed of the dropouts, too
  }
  void validate() const;
};

/// Returns the poses of a tracker with faults, in their order: lost poses are left out, the others
/// are moved, and jumps are marked by inserted poses. Latency changes no pose: the caller delays
/// poses when it merges them with events. Infinite or NaN poses and times beyond kEndOfTimeNs stay.
/// @throws std::invalid_argument if a pose to move is older than the pose before it.
std::vector<StampedPose> withFaults(const std::vector<StampedPose>& poses,
                                    const TrackerFaults& faults);

}  // namespace efm
