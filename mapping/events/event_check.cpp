// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/events/event_check.h"

#include <algorithm>
#include <stdexcept>

#include "mapping/geometry/timestamp.h"

namespace efm {

void refuse(const Event& event, int camera, const std::string& expected) {
  throw std::invalid_argument("camera " + std::to_string(camera) + ", event at " +
                              formatSeconds(event.t_ns) + " s: " + expected);
}

void requireInsideSensor(EventSpan events, int camera, const CameraModel& model) {
  const Event* outside = std::find_if(events.begin(), events.end(), [&](const Event& event) {
    return event.x >= model.width || event.y >= model.height;
  });
  if (outside == events.end()) return;
  refuse(*outside, camera,
         "pixel (" + std::to_string(outside->x) + ", " + std::to_string(outside->y) +
             ") must lie inside the sensor of " + std::to_string(model.width) + "x" +
             std::to_string(model.height));
}

}  // namespace efm
