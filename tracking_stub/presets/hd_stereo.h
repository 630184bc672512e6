// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>

#include "tracking_stub/sensor/simulated_rig.h"

namespace efm {

/// A stereo pair of high resolution in a furnished room: the preset `hd_stereo`.
///
/// Two cameras of 1280 x 720 pixels, radial and tangential distortion, focal lengths around 900
/// pixels, 0.12 m apart; everything is between 0.8 and 5 m away. World: z up. 0.8 s from t = 1 s,
/// about 2.8 million events per camera.
Simulation makeHdStereo(std::uint64_t seed);

}  // namespace efm
