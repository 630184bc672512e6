// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>

#include "mapping/geometry/rigid3.h"

namespace efm {

/// Noise that is constant within a time interval, the window of a keyframe. The default is none.
struct KeyframeNoiseOptions {
  double noise_m = 0;    ///< Standard deviation on each axis, 0 to 1e3.
  double noise_rad = 0;  ///< Standard deviation on each axis, 0 to 3.2.
  /// Length of the intervals, 1e6 to 1e15. Required where there is noise.
  std::optional<std::int64_t> length_ns;
  /// Start of interval 0. Default: the time of the first pose.
  std::optional<std::int64_t> start_ns;

  bool any() const { return noise_m > 0 || noise_rad > 0; }
  void validate() const;
};

/// The intervals and their pose errors. An error depends on the seed and the interval's number
/// only.
class KeyframeNoise {
 public:
  struct Clock {
    std::int64_t first_pose_ns = 0;
    std::int64_t tick_ns = 1;  ///< Intervals begin at multiples of it, rounded down.
  };
  KeyframeNoise(const KeyframeNoiseOptions& options, const Clock& clock, std::uint64_t seed);

  /// Number of the interval that contains a time. May be negative.
  std::int64_t intervalAt(std::int64_t t_ns) const;
  std::int64_t beginNs(std::int64_t interval) const;

  /// The rigid motion from the true poses of an interval to the wrong ones: a rotation about a
  /// position and a shift.
  /// @param rig_world the position of the rig where the interval begins.
  Rigid3 errorOf(std::int64_t interval, const Eigen::Vector3d& rig_world) const;

 private:
  KeyframeNoiseOptions options_;
  std::int64_t start_ns_;
  std::int64_t tick_ns_;
  std::uint64_t seed_;
};

}  // namespace efm
