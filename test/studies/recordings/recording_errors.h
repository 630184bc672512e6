// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>

#include "mapping/geometry/angle.h"
#include "test/studies/recordings/recording_cache.h"
#include "tracking_stub/sensor/event_noise.h"

namespace efm::studies {

/// How far a tracker's poses sway around the true ones: on each axis a sine of its own phase and
/// about the same frequency.
struct PoseSway {
  double amplitude_m = 0;
  double amplitude_rad = 0;
  double frequency_hz = 1;
};

/// What an indoor tracker may err by: 1 cm and 0.1 degrees.
inline constexpr PoseSway kTrackerSway{0.01, 0.1 * kRadiansPerDegree, 1};

/// The recording as a tracker with such errors would have it; the truth stays where it was.
Recording withPoseSway(const Recording& recording, const PoseSway& sway);

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

/// The recording with a calibration that has one camera turned about its vertical axis.
Recording withTurnedCamera(const Recording& recording, std::size_t camera, double turn_rad);

/// The recording with noise among its events: what the simulator would have made of the same
/// simulation with this noise, because noise leaves the pixels' memory alone.
Recording withNoise(const Recording& recording, const EventNoiseOptions& noise);

}  // namespace efm::studies
