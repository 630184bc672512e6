// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>

#include "tracking_stub/sensor/simulated_rig.h"

namespace efm {

/// A stereo pair on a car's roof drives down a street: the preset `drive_stereo`.
///
/// Two cameras of 640 x 480 pixels, focal length 550 pixels, slight radial distortion, 0.60 m
/// apart, 1.9 m above the road; 8 m/s forwards. What is seen is between 4 and 50 m away, or sky.
/// World: y along the street, z up, the road at z = 0. 1.2 s from t = 1 s.
Simulation makeDriveStereo(std::uint64_t seed);

}  // namespace efm
