// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "mapping/keyframe_depth_map.h"
#include "maps/cloud_point.h"

namespace efm {

/// The points of a keyframe in the world, p_world = T_world_ref * Z * K^-1 (x, y, 1)^T: one for
/// every pixel that has a depth and a confidence above 0, in the order of the image's rows.
/// @throws std::invalid_argument where the two images differ in size from the view.
std::vector<CloudPoint> keyframeCloud(const KeyframeDepthMap& keyframe);

/// The clouds of the keyframe's single cameras, one after the other: late fusion, the naive
/// baseline that fusing DSIs is compared with (Ghosh and Gallego 2022, Sec. 3.1). Empty where the
/// keyframe has no maps of single cameras.
/// @throws std::invalid_argument as `keyframeCloud` does.
std::vector<CloudPoint> lateFusionCloud(const KeyframeDepthMap& keyframe);

}  // namespace efm
