// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>

#include "tracking_stub/sensor/simulated_rig.h"

namespace efm {

/// One camera on a linear slider passes boards and boxes: the preset `slider`, like `slider_depth`
/// of the Event Camera Dataset (Mueggler et al., IJRR 2017).
///
/// 240 x 180 pixels, focal length 335 pixels, radial and tangential distortion; 0.32 m/s to the
/// right without turning, so that edges along the motion fire no events and have no depth.
/// Everything is between 0.5 and 2.4 m away. World: the camera's frame at the middle of the way. 2
/// s from t = 1 s.
Simulation makeSlider(std::uint64_t seed);

}  // namespace efm
