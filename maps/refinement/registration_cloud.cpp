// SPDX-License-Identifier: BSD-3-Clause
#include "maps/refinement/registration_cloud.h"

#include <algorithm>
#include <utility>

namespace efm {
namespace {

/// Margin of the range of depths in view, because a wall that faces the view has one depth.
constexpr double kDepthMarginSigmas = 3;

}  // namespace

RegistrationCloud::RegistrationCloud(const KeyframeDepthMap& keyframe,
                                     const RegistrationCloudOptions& options)
    : view_(keyframe.view) {
  RegistrationPoints selected = selectPoints(keyframe, options);
  points_ = std::move(selected.points);
  num_query_points_ = std::min(points_.size(), static_cast<std::size_t>(options.max_points));
  constexpr float kMinSigma = 1e-9F;  // 1/m: a variance may be 0
  px_per_inverse_depth_ = 1 / std::max(selected.median_inverse_depth_sigma, kMinSigma);
  max_inverse_depth_ = selected.max_inverse_depth;
  min_inverse_depth_ = selected.min_inverse_depth;
}

Eigen::Vector3f RegistrationCloud::viewCoordinates(const Eigen::Vector3d& p_ref) const {
  const Eigen::Vector2d pixel = view_.project(p_ref);
  return Eigen::Vector3d(pixel.x(), pixel.y(), px_per_inverse_depth_ / p_ref.z()).cast<float>();
}

bool RegistrationCloud::isInView(const Eigen::Vector3d& p_ref) const {
  if (points_.empty() || !(p_ref.z() > 0)) return false;
  const double margin = kDepthMarginSigmas / px_per_inverse_depth_;
  const double inverse_depth = 1 / p_ref.z();
  if (inverse_depth > max_inverse_depth_ + margin || inverse_depth < min_inverse_depth_ - margin) {
    return false;
  }
  const Eigen::Vector2d pixel = view_.project(p_ref);
  return pixel.x() >= 0 && pixel.y() >= 0 && pixel.x() <= view_.width - 1 &&
         pixel.y() <= view_.height - 1;
}

std::optional<std::size_t> RegistrationCloud::nearest(const Eigen::Vector3d& p_ref,
                                                      double max_distance_px) const {
  if (points_.empty() || !(p_ref.z() > 0)) return std::nullopt;
  const Eigen::Vector3f at = viewCoordinates(p_ref);
  const auto margin = static_cast<float>(max_distance_px);
  const auto within = [&](float value, int size) {
    return value >= -margin && value <= static_cast<float>(size - 1) + margin;
  };
  if (!within(at.x(), view_.width) || !within(at.y(), view_.height)) return std::nullopt;
  if (!tree_) {
    std::vector<Eigen::Vector3f> coordinates;
    coordinates.reserve(points_.size());
    for (const RegistrationPoint& point : points_) {
      coordinates.push_back(viewCoordinates(point.p_ref.cast<double>()));
    }
    tree_ = std::make_unique<PointTree>(coordinates);
  }
  const PointTree::Neighbor neighbor = tree_->nearest(at);
  if (!(neighbor.squared_distance <= margin * margin)) return std::nullopt;
  return neighbor.index;
}

void RegistrationCloud::clear() noexcept {
  std::vector<RegistrationPoint>().swap(points_);
  num_query_points_ = 0;
  max_inverse_depth_ = 0;
  min_inverse_depth_ = 0;
  tree_.reset();
}

void RegistrationCloud::releaseTree() const { tree_.reset(); }

}  // namespace efm
