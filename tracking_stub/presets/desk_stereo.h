// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>

#include "tracking_stub/sensor/simulated_rig.h"

namespace efm {

/// A hand-held stereo pair looks over a cluttered desk into a room: the preset `desk_stereo`.
///
/// Two cameras of 346 x 260 pixels without distortion, focal length 226 pixels, 0.10 m apart; every
/// pixel sees something between about 0.6 and 4.5 m. World: x right, y into the room, z up, the
/// desk's top at z = 0. 2 s from t = 1 s, about a million events per camera.
Simulation makeDeskStereo(std::uint64_t seed);

}  // namespace efm
