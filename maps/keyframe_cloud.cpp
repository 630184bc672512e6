// SPDX-License-Identifier: BSD-3-Clause
#include "maps/keyframe_cloud.h"

#include <stdexcept>

namespace efm {
namespace {

void appendPoints(const DepthMap& map, const KeyframeDepthMap& keyframe,
                  std::vector<CloudPoint>& points) {
  const ReferenceView& view = keyframe.view;
  const cv::Size size(view.width, view.height);
  if (map.depth.size() != size || map.confidence.size() != size) {
    throw std::invalid_argument("the keyframe's images are not of its view's size");
  }
  for (int y = 0; y < view.height; ++y) {
    const float* depth_row = map.depth[y];
    const float* confidence_row = map.confidence[y];
    for (int x = 0; x < view.width; ++x) {
      if (!(depth_row[x] > 0) || !(confidence_row[x] > 0)) continue;
      const Eigen::Vector3d p_ref = view.pointAt(x, y, depth_row[x]);
      points.push_back({keyframe.T_world_ref * p_ref, confidence_row[x]});
    }
  }
}

}  // namespace

std::vector<CloudPoint> keyframeCloud(const KeyframeDepthMap& keyframe) {
  std::vector<CloudPoint> points;
  appendPoints(keyframe.map, keyframe, points);
  return points;
}

std::vector<CloudPoint> lateFusionCloud(const KeyframeDepthMap& keyframe) {
  std::vector<CloudPoint> points;
  for (const CameraDepthMap& camera : keyframe.camera_maps) {
    appendPoints(camera.map, keyframe, points);
  }
  return points;
}

}  // namespace efm
