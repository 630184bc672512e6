// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "mapping/geometry/depth_planes.h"
#include "test/studies/methods/method_comparison.h"
#include "tracking_stub/sensor/simulated_rig.h"

namespace efm::studies {

/// What the paper simulates with ESIM in its scene flying_room (Secs. 4.7 and 4.10), here in the
/// room of the preset hd_stereo: two cameras without distortion, 0.20 m apart, 77 degrees wide and
/// 4:3 at any resolution.

/// @param duration_s from t = 1 s.
Simulation flyingRoom(double duration_s);

/// The same with cameras of another resolution: same scene, way and field of view.
Simulation withWidth(Simulation simulation, int width_px);
/// The same with another contrast threshold of both signs.
Simulation withThreshold(Simulation simulation, double threshold);

/// Alg. 1 and one camera over the depths of the room.
Method flyingRoomStereo();
Method flyingRoomMono();

}  // namespace efm::studies
