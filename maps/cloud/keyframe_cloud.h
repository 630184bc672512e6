// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <limits>
#include <vector>

#include "mapping/geometry/rigid3.h"
#include "mapping/keyframes/keyframe_depth_map.h"
#include "maps/cloud/cloud_point.h"
#include "maps/cloud/map_point.h"

namespace efm {

/// A point of a keyframe in its reference view. Float like the depth map, so a stored keyframe has
/// exactly the points of the map, anywhere in the world.
struct ViewPoint {
  Eigen::Vector3f p_ref = Eigen::Vector3f::Zero();  ///< Metres, frame `ref`.
  float confidence = 0;                             ///< Fused ray density at the point, above 0.
  /// Standard deviation of depth, metres; NaN where it is not known.
  float sigma = std::numeric_limits<float>::quiet_NaN();
};

/// The points of a keyframe, p_ref = Z * K^-1 (x, y, 1)^T: one for each pixel with a depth and a
/// confidence above 0, row by row. sigma_Z = Z^2 * sigma_(1/Z): Z is the inverse of the inverse
/// depth, whose variance the keyframe has.
/// @throws std::invalid_argument where an image does not have the size of the view.
std::vector<ViewPoint> viewPoints(const KeyframeDepthMap& keyframe);

/// The points of the single cameras of a keyframe, one camera after the other: late fusion, the
/// baseline for fused DSIs (Ghosh and Gallego 2022, Sec. 3.3.1). Empty where the keyframe has no
/// maps of single cameras.
/// @throws std::invalid_argument as `viewPoints` does.
std::vector<ViewPoint> lateFusionPoints(const KeyframeDepthMap& keyframe);

/// p_world = T_world_ref * p_ref, each with a support of 1.
std::vector<CloudPoint> pointsInWorld(const std::vector<ViewPoint>& points,
                                      const Rigid3& T_world_ref);

/// `viewPoints` in the world, as a cloud of PCL.
/// @param resolution_m see `mapCloudOf`.
MapCloud::ConstPtr keyframeCloud(const KeyframeDepthMap& keyframe, double resolution_m = 0.01);

}  // namespace efm
