// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <string>

#include "mapping/events/event.h"
#include "mapping/geometry/camera.h"

namespace efm {

/// An event, or a pose, that is farther ahead of its stream than this is wrong where the next one
/// is back. The last one, which nothing follows, is wrong after a longer pause alone.
inline constexpr std::int64_t kFarAheadNs = 1'000'000'000;
inline constexpr std::int64_t kMaxLastPauseNs = 10'000'000'000;

/// @throws std::invalid_argument "camera 0, event at 1.000000000 s: expected".
[[noreturn]] void refuse(const Event& event, int camera, const std::string& expected);

/// @throws std::invalid_argument naming the first event that lies outside the sensor.
void requireInsideSensor(EventSpan events, int camera, const CameraModel& model);

}  // namespace efm
