// SPDX-License-Identifier: BSD-3-Clause
#include "maps/cloud/keyframe_cloud.h"

#include <cmath>
#include <stdexcept>

namespace efm {
namespace {

/// NaN where the peak has no curvature, or the map has no variances.
float sigmaOf(const DepthMap& map, int x, int y) {
  const float variance = map.variance.empty() ? INFINITY : map.variance(y, x);
  if (!std::isfinite(variance)) return std::numeric_limits<float>::quiet_NaN();
  const float depth_m = map.depth(y, x);
  return depth_m * depth_m * std::sqrt(variance);
}

void appendPoints(const DepthMap& map, const ReferenceView& view, std::vector<ViewPoint>& points) {
  const cv::Size size(view.width, view.height);
  if (map.depth.size() != size || map.confidence.size() != size ||
      (!map.variance.empty() && map.variance.size() != size)) {
    throw std::invalid_argument("the keyframe's images are not of its view's size");
  }
  for (int y = 0; y < view.height; ++y) {
    const float* depth_row = map.depth[y];
    const float* confidence_row = map.confidence[y];
    for (int x = 0; x < view.width; ++x) {
      if (!(depth_row[x] > 0) || !(confidence_row[x] > 0)) continue;
      points.push_back(
          {view.pointAt(x, y, depth_row[x]).cast<float>(), confidence_row[x], sigmaOf(map, x, y)});
    }
  }
}

}  // namespace

std::vector<ViewPoint> viewPoints(const KeyframeDepthMap& keyframe) {
  std::vector<ViewPoint> points;
  appendPoints(keyframe.map, keyframe.view, points);
  return points;
}

std::vector<ViewPoint> lateFusionPoints(const KeyframeDepthMap& keyframe) {
  std::vector<ViewPoint> points;
  for (const CameraDepthMap& camera : keyframe.camera_maps) {
    appendPoints(camera.map, keyframe.view, points);
  }
  return points;
}

std::vector<CloudPoint> pointsInWorld(const std::vector<ViewPoint>& points,
                                      const Rigid3& T_world_ref) {
  std::vector<CloudPoint> in_world;
  in_world.reserve(points.size());
  for (const ViewPoint& point : points) {
    in_world.push_back(
        {T_world_ref * point.p_ref.cast<double>(), point.confidence, 1, 0, point.sigma});
  }
  return in_world;
}

MapCloud::ConstPtr keyframeCloud(const KeyframeDepthMap& keyframe, double resolution_m) {
  return mapCloudOf(pointsInWorld(viewPoints(keyframe), keyframe.T_world_ref), resolution_m);
}

}  // namespace efm
