// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>

#include "tracking_stub/sensor/simulated_rig.h"

namespace efm {

/// A stereo pair goes once around in a furnished room, looking outwards, and comes back to where it
/// began: the preset `room_stereo`.
///
/// The cameras are those of desk_stereo (346 x 260, no distortion, 0.10 m apart). The room is 7.2 x
/// 5.8 x 2.8 m; everything is between 0.9 and 7 m from the cameras. World: origin in the middle of
/// the floor, z up. 8 s from t = 1 s.
Simulation makeRoomStereo(std::uint64_t seed);

}  // namespace efm
