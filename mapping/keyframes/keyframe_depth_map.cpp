// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/keyframes/keyframe_depth_map.h"

namespace efm {

EventImage eventImageOf(const CameraEvents& camera) {
  const CameraModel& model = camera.calibration->model;
  EventImage image{camera.camera, cv::Mat_<cv::Vec2i>::zeros(model.height, model.width)};
  for (const Event& event : camera.events) {
    ++image.counts(event.y, event.x)[event.polarity ? 1 : 0];
  }
  return image;
}

}  // namespace efm
