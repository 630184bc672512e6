// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "mapping/geometry/reference_view.h"
#include "test/studies/methods/method_comparison.h"
#include "tracking_stub/sensor/simulated_rig.h"

namespace efm::studies {

/// The paper simulates its scene flying_room with ESIM (Secs. 4.7 and 4.10). Here it is the room of
/// the preset hd_stereo: two cameras without distortion, 0.20 m apart, 77 degrees wide, 4:3.

/// @param duration_s from t = 1 s.
Simulation flyingRoom(double duration_s);

/// The same scene, motion and field of view with cameras of another resolution.
Simulation withWidth(Simulation simulation, int width_px);
/// The same with another contrast threshold of both polarities.
Simulation withThreshold(Simulation simulation, double threshold);

/// Alg. 1 and one camera over the depths of the room.
Method flyingRoomStereo();
Method flyingRoomMono();

}  // namespace efm::studies
