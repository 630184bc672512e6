// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <vector>

#include "mapping/geometry/rigid3.h"
#include "mapping/keyframes/keyframe_depth_map.h"
#include "maps/cloud/cloud_point.h"

namespace efm {

/// A point of a keyframe as its reference view sees it. Float, as the depth map is: what is stored
/// of a keyframe is exactly what went into the map, wherever in the world that is.
struct ViewPoint {
  Eigen::Vector3f p_ref = Eigen::Vector3f::Zero();  ///< Metres, frame `ref`.
  float confidence = 0;                             ///< Fused ray density at the point, above 0.
};

/// The points of a keyframe, p_ref = Z * K^-1 (x, y, 1)^T: one for every pixel that has a depth and
/// a confidence above 0, in the order of the image's rows.
/// @throws std::invalid_argument where the two images differ in size from the view.
std::vector<ViewPoint> viewPoints(const KeyframeDepthMap& keyframe);

/// The points of the keyframe's single cameras, one camera after the other: late fusion, the naive
/// baseline that fusing DSIs is compared with (Ghosh and Gallego 2022, Sec. 3.1). Empty where the
/// keyframe has no maps of single cameras.
/// @throws std::invalid_argument as `viewPoints` does.
std::vector<ViewPoint> lateFusionPoints(const KeyframeDepthMap& keyframe);

/// The points in the world, p_world = T_world_ref * p_ref, each with a support of 1.
std::vector<CloudPoint> pointsInWorld(const std::vector<ViewPoint>& points,
                                      const Rigid3& T_world_ref);

/// `viewPoints` and `lateFusionPoints` in the world.
std::vector<CloudPoint> keyframeCloud(const KeyframeDepthMap& keyframe);
std::vector<CloudPoint> lateFusionCloud(const KeyframeDepthMap& keyframe);

}  // namespace efm
