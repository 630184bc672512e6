// SPDX-License-Identifier: BSD-3-Clause
#include "test/studies/methods/visible_edges.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <vector>

namespace efm::studies {
namespace {

constexpr int kEventsPerCamera = 3;
constexpr double kSameDepth = 0.03;  ///< Max relative difference of depths of one surface.

/// The pixel that shows a point.
std::optional<cv::Point> pixelOf(const Eigen::Vector3d& p_ref, const ReferenceView& view,
                                 const cv::Mat1f& truth_m) {
  if (!(p_ref.z() > 0)) return std::nullopt;
  const cv::Point pixel(static_cast<int>(std::lround(view.fx * p_ref.x() / p_ref.z() + view.cx)),
                        static_cast<int>(std::lround(view.fy * p_ref.y() / p_ref.z() + view.cy)));
  if (!cv::Rect(0, 0, view.width, view.height).contains(pixel)) return std::nullopt;
  const double true_m = truth_m(pixel);
  if (!(std::abs(true_m - p_ref.z()) < kSameDepth * true_m)) return std::nullopt;
  return pixel;
}

}  // namespace

cv::Mat1b visibleEdges(const Recording& recording, const KeyframeDepthMap& keyframe,
                       const cv::Mat1f& truth_m) {
  const Rigid3 T_ref_world = keyframe.T_world_ref.inverse();
  cv::Mat1i all = cv::Mat1i::zeros(truth_m.size());
  cv::Mat1b seen_by_each(truth_m.size(), 255);
  for (std::size_t camera = 0; camera < recording.events.size(); ++camera) {
    cv::Mat1i fired = cv::Mat1i::zeros(truth_m.size());
    const EventSpan events = recording.eventsOf(camera, keyframe.window);
    const auto first = static_cast<std::size_t>(events.begin() - recording.events[camera].data());
    for (std::size_t i = first; i < first + events.size(); ++i) {
      const Eigen::Vector3d p_ref = T_ref_world * recording.sources[camera][i].cast<double>();
      if (const auto pixel = pixelOf(p_ref, keyframe.view, truth_m)) ++fired(*pixel);
    }
    seen_by_each &= fired > 0;
    all += fired;
  }
  return seen_by_each & (all >= kEventsPerCamera * static_cast<int>(recording.events.size()));
}

}  // namespace efm::studies
