// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "maps/cloud/cloud_point.h"

namespace efm {

struct OutlierRemovalOptions {
  /// Points with too few others within this distance are removed. Metres, 0 (none is removed) or
  /// 1e-6 to 1e6. The default keeps everything: what a good distance is depends on how far the
  /// scene is from the camera.
  double outlier_radius_m = 0;
  /// A point stays with at least so many others, itself not counted, within the radius. Range: 1 to
  /// 10000. The default is that of EMVS (Rebecq et al., IJCV 2018, in its published code).
  int outlier_min_neighbors = 3;

  /// @throws std::invalid_argument naming the field, its value and the allowed range.
  void validate() const;
};

/// The points that are not alone, in the order in which they came. Meant for one keyframe's cloud,
/// before it meets others: an isolated point is then one that no edge of its depth map supports.
///
/// Distances are taken in float from the middle of the points, so they are exact to 1e-7 of the
/// cloud's extent, however far from the world's origin it lies.
/// @throws std::invalid_argument where the options are not valid, or a point is not finite or lies
/// beyond a float's range from the others.
std::vector<CloudPoint> removeOutliers(std::vector<CloudPoint> points,
                                       const OutlierRemovalOptions& options);

}  // namespace efm
