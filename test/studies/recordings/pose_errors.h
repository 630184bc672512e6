// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>

#include "test/studies/recordings/recording_cache.h"

namespace efm::studies {

/// What may be wrong with a tracker's poses. The truth stays where it was.
struct PoseErrors {
  /// The tracker's rate; between its poses the mapper interpolates.
  std::int64_t period_ns = 10'000'000;
  /// Of every pose on its own: standard deviation on each axis.
  double noise_m = 0;
  double noise_rad = 0;
  /// As odometry drifts: it adds up what it saw of the way along a heading that turns away at a
  /// constant rate about each axis of the world, and runs away at a constant speed along each.
  double drift_m_s = 0;
  double drift_rad_s = 0;
  /// The poses' stamps are so much late.
  std::int64_t late_ns = 0;
  std::uint64_t seed = 1;
};

/// The recording as such a tracker would have it.
Recording withPoseErrors(const Recording& recording, const PoseErrors& errors);

/// The recording with the stamps of one camera's events late.
Recording withLateCamera(const Recording& recording, std::size_t camera, std::int64_t late_ns);

}  // namespace efm::studies
