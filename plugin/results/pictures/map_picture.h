// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <opencv2/core.hpp>
#include <vector>

#include "mapping/geometry/trajectory.h"
#include "maps/cloud/map_point.h"

namespace efm {

/// A map from above and from the side, for a paper: the points coloured by height and the denser
/// the more opaque, the trajectory, a scale bar in metres. Up to 1500 pixels wide and high.
/// @param cloud may be empty: then the picture has the trajectory alone.
/// @param trajectory T_world_ref of the keyframes.
/// @param voxel_size_m of the map: points are drawn no smaller than their voxels.
/// @throws std::invalid_argument if there is neither a point nor a keyframe.
cv::Mat3b drawMap(const MapCloud& cloud, const std::vector<StampedPose>& trajectory,
                  double voxel_size_m);

}  // namespace efm
