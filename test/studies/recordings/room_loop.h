// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "tracking_stub/sensor/simulated_rig.h"

namespace efm::studies {

/// The rig of the preset room_stereo on a longer way around the same room: an ellipse of 3.6 x 2.2
/// m in 20 s, by hand. What lasts longer than that sees its first places again.
Simulation roundTheRoom(double duration_s);

}  // namespace efm::studies
