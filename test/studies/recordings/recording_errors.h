// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>

#include "mapping/geometry/rigid3.h"
#include "test/studies/recordings/recording_cache.h"
#include "tracking_stub/sensor/simulated_rig.h"

namespace efm::studies {

/// Sway of a tracker's poses around the true poses: on each axis a sine with its own phase and
/// about the same frequency.
struct PoseSway {
  double amplitude_m = 0;
  double amplitude_rad = 0;
  double frequency_hz = 1;
};

/// A possible error of an indoor tracker: 1 cm and 0.1 degrees.
inline constexpr PoseSway kTrackerSway{0.01, 0.1 * kRadiansPerDegree, 1};

/// The recording with swaying poses. The truth does not change.
Recording withPoseSway(const Recording& recording, const PoseSway& sway);

/// Errors of a tracker's poses. The truth does not change.
struct PoseErrors {
  /// Period of the poses. The mapper interpolates between them.
  std::int64_t period_ns = 10'000'000;
  /// Independent noise of every pose: standard deviation on each axis.
  double noise_m = 0;
  double noise_rad = 0;
  /// Drift of odometry: the heading rotates at a constant rate about each axis of the world, and
  /// the position moves at a constant speed along each axis.
  double drift_m_s = 0;
  double drift_rad_s = 0;
  /// Delay of the poses' stamps.
  std::int64_t late_ns = 0;
  std::uint64_t seed = 1;
};

/// The recording with pose errors.
Recording withPoseErrors(const Recording& recording, const PoseErrors& errors);

/// The recording with delayed stamps of one camera's events.
Recording withLateCamera(const Recording& recording, std::size_t camera, std::int64_t late_ns);

/// The recording with a calibration error: one camera is rotated about its vertical axis.
Recording withRotatedCamera(const Recording& recording, std::size_t camera, double angle_rad);

/// The recording with noise events. The simulator would make the same events with this noise,
/// because noise does not change the pixels' memory.
Recording withNoise(const Recording& recording, const EventNoiseOptions& noise);

}  // namespace efm::studies
