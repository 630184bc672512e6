// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>

#include "tracking_stub/sensor/simulated_rig.h"

namespace efm {

/// Three cameras look into a corner of a furnished room: the preset `trinocular`.
///
/// 640 x 480 pixels each, equidistant distortion with coefficients of their own, focal lengths of
/// 400 to 410 pixels. Camera 1 stands 0.16 m to the right and looks a little inwards; camera 2
/// stands 0.14 m above the middle between them, tilted down and turned by 90 degrees about its axis
/// (upright format). All see what is in the middle of camera 0's view. Everything is between 0.7
/// and 5 m away. World: z up. 1 s from t = 1 s.
Simulation makeTrinocular(std::uint64_t seed);

}  // namespace efm
