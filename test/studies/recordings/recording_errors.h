// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>

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

/// The recording with a calibration that has one camera turned about its vertical axis.
Recording withTurnedCamera(const Recording& recording, std::size_t camera, double turn_rad);

/// The recording with noise among its events: what the simulator would have made of the same
/// simulation with this noise, because noise leaves the pixels' memory alone.
Recording withNoise(const Recording& recording, const EventNoiseOptions& noise);

}  // namespace efm::studies
