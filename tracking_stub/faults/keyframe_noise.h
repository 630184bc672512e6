// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>

#include "mapping/geometry/rigid3.h"

namespace efm {

/// Noise that stays the same within a stretch of time, a keyframe's window. The default is none.
struct KeyframeNoiseOptions {
  double noise_m = 0;    ///< Standard deviation on each axis, 0 to 1e3.
  double noise_rad = 0;  ///< Standard deviation on each axis, 0 to 3.2.
  /// Length of the stretches, 1e6 to 1e15; must be given where there is noise.
  std::optional<std::int64_t> length_ns;
  /// Where stretch 0 begins; the first pose's time where not given.
  std::optional<std::int64_t> start_ns;

  bool any() const { return noise_m > 0 || noise_rad > 0; }
  /// @throws std::invalid_argument naming the field, its value and the allowed range.
  void validate() const;
};

/// When the stretches are, and by how much poses are wrong in each: what is drawn depends on the
/// seed and the stretch's number alone.
class KeyframeNoise {
 public:
  struct Clock {
    std::int64_t first_pose_ns = 0;
    std::int64_t tick_ns = 1;  ///< Stretches begin at multiples of it, rounded down.
  };
  /// @throws std::invalid_argument where the options are not valid.
  KeyframeNoise(const KeyframeNoiseOptions& options, const Clock& clock, std::uint64_t seed);

  /// Number of the stretch that holds a time, may be negative.
  std::int64_t stretchAt(std::int64_t t_ns) const;
  std::int64_t beginNs(std::int64_t stretch) const;

  /// The rigid motion that takes every pose of a stretch where it wrongly is: a turn about a
  /// position, the rig's where the stretch begins, and a shift.
  Rigid3 errorOf(std::int64_t stretch, const Eigen::Vector3d& rig_world) const;

 private:
  KeyframeNoiseOptions options_;
  std::int64_t start_ns_;
  std::int64_t tick_ns_;
  std::uint64_t seed_;
};

}  // namespace efm
