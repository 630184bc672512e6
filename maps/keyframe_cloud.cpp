// SPDX-License-Identifier: BSD-3-Clause
#include "maps/keyframe_cloud.h"

#include <stdexcept>

namespace efm {

std::vector<CloudPoint> keyframeCloud(const KeyframeDepthMap& keyframe) {
  const ReferenceView& view = keyframe.view;
  const cv::Mat1f& depth = keyframe.map.depth;
  const cv::Mat1f& confidence = keyframe.map.confidence;
  const cv::Size size(view.width, view.height);
  if (depth.size() != size || confidence.size() != size) {
    throw std::invalid_argument("the keyframe's images are not of its view's size");
  }

  std::vector<CloudPoint> points;
  for (int y = 0; y < view.height; ++y) {
    const float* depth_row = depth[y];
    const float* confidence_row = confidence[y];
    for (int x = 0; x < view.width; ++x) {
      if (!(depth_row[x] > 0) || !(confidence_row[x] > 0)) continue;
      const Eigen::Vector3d p_ref = view.pointAt(x, y, depth_row[x]);
      points.push_back({keyframe.T_world_ref * p_ref, confidence_row[x]});
    }
  }
  return points;
}

}  // namespace efm
