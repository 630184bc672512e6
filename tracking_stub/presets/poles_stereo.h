// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>

#include "tracking_stub/sensor/simulated_rig.h"

namespace efm {

/// A hand-held stereo pair before thin poles, 3 to 6 pixels wide, and a wall behind them: the
/// preset `poles_stereo`.
///
/// The cameras are those of desk_stereo. The poles stand 0.9 to 3 m away, the wall at 4 m. World: y
/// forward, z up, the origin where the cameras are. 1.5 s from t = 1 s.
Simulation makePolesStereo(std::uint64_t seed);

}  // namespace efm
