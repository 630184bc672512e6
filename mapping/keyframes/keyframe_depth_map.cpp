// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/keyframes/keyframe_depth_map.h"

#include <algorithm>
#include <cmath>

namespace efm {

EventImage eventImageOf(const CameraEvents& camera) {
  const CameraModel& model = camera.calibration->model;
  EventImage image{camera.camera, cv::Mat_<cv::Vec2i>::zeros(model.height, model.width)};
  for (const Event& event : camera.events) {
    ++image.counts(event.y, event.x)[event.polarity ? 1 : 0];
  }
  return image;
}

cv::Mat_<cv::Vec2i> viewEventsOf(const CameraEvents& camera, const ReferenceView& view,
                                 std::int64_t t_ref_ns) {
  constexpr std::size_t kPixelsPerEvent = 8;
  const CameraModel& model = camera.calibration->model;
  const EventSpan& all = camera.events;
  const std::size_t count =
      std::min(all.size(), static_cast<std::size_t>(model.width) *
                               static_cast<std::size_t>(model.height) / kPixelsPerEvent);
  const Event* at_reference =
      std::lower_bound(all.begin(), all.end(), t_ref_ns,
                       [](const Event& event, std::int64_t t_ns) { return event.t_ns < t_ns; });
  const auto before = static_cast<std::size_t>(at_reference - all.begin());
  const std::size_t first = std::min(before - std::min(before, count / 2), all.size() - count);
  cv::Mat_<cv::Vec2i> counts = cv::Mat_<cv::Vec2i>::zeros(view.height, view.width);
  for (const Event& event : all.part(first, first + count)) {
    const Eigen::Vector2d ray = camera.undistortion->ray(event.x, event.y);
    const Eigen::Vector2d pixel = view.project(ray.homogeneous());
    if (!((pixel.array() > -0.5).all() && pixel.x() < view.width - 0.5 &&
          pixel.y() < view.height - 0.5)) {
      continue;  // also if the pixel is not a number: no ray
    }
    const auto x = static_cast<int>(std::lround(pixel.x()));
    const auto y = static_cast<int>(std::lround(pixel.y()));
    ++counts(y, x)[event.polarity ? 1 : 0];
  }
  return counts;
}

}  // namespace efm
