// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "tracking_stub/sensor/simulated_rig.h"

namespace efm::studies {

/// The rig of the preset room_stereo on a longer loop in the same room: a hand-held ellipse of 3.6
/// x 2.2 m in 20 s. After 20 s it returns to its first positions.
Simulation roomLoop(double duration_s);

}  // namespace efm::studies
