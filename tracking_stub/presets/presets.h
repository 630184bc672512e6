// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>

#include "tracking_stub/sensor/simulated_rig.h"

namespace efm {

/// The presets: simulations that are ready to run. Each starts at t = 1 s. README.md has a table of
/// their cameras, durations and depths.

/// A hand-held stereo pair looks over a cluttered desk into a room. World: x right, y into the
/// room, z up, the desk's top at z = 0. About a million events per camera.
Simulation makeDeskStereo(std::uint64_t seed);

/// A stereo pair on a car's roof, 1.9 m above the road, drives down a street at 8 m/s. World: y
/// along the street, z up, the road at z = 0. Some pixels see the sky.
Simulation makeDriveStereo(std::uint64_t seed);

/// A stereo pair of high resolution in a furnished room. World: z up. About 2.8 million events per
/// camera.
Simulation makeHdStereo(std::uint64_t seed);

/// The cameras of desk_stereo before thin poles, 3 to 6 pixels wide, and a wall behind them. World:
/// y forward, z up, the origin at the cameras.
Simulation makePolesStereo(std::uint64_t seed);

/// The cameras of desk_stereo go once around in a furnished room and look outwards; the last pose
/// is the first pose. World: origin in the middle of the floor, z up.
Simulation makeRoomStereo(std::uint64_t seed);

/// One camera on a linear slider passes boards and boxes, like `slider_depth` of the Event Camera
/// Dataset (Mueggler et al., IJRR 2017). It does not rotate, so edges along the motion fire no
/// events and have no depth. World: the camera's frame in the middle of the path.
Simulation makeSlider(std::uint64_t seed);

/// Three cameras, each with its own calibration, look into a corner of a furnished room. Camera 1
/// is 0.16 m to the right and looks slightly inwards. Camera 2 is 0.14 m above the middle of the
/// other two, tilted down, and rotated by 90 degrees about its axis. All see the middle of camera
/// 0's view. World: z up.
Simulation makeTrinocular(std::uint64_t seed);

}  // namespace efm
