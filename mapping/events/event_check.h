// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include "mapping/events/event.h"
#include "mapping/geometry/camera.h"

namespace efm {

/// @throws std::invalid_argument "camera 0, event at 1.000000000 s: expected".
[[noreturn]] void refuse(const Event& event, int camera, const std::string& expected);

/// @throws std::invalid_argument naming the first event that lies outside the sensor.
void requireInsideSensor(EventSpan events, int camera, const CameraModel& model);

}  // namespace efm
