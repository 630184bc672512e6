// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "maps/cloud/cloud_point.h"

namespace efm {

struct OutlierRemovalOptions {
  /// Points with too few others within this distance are removed. Metres; 0 (no point is removed)
  /// or 1e-6 to 1e6. There is no default distance, because it depends on the depth of the scene.
  double outlier_radius_m = 0;
  /// A point is kept with at least this number of others within the radius. Range: 1 to 10000. The
  /// default is that of the published code of EMVS (Rebecq et al., IJCV 2018).
  int outlier_min_neighbors = 3;

  /// @throws std::invalid_argument naming the field, its value and the allowed range.
  void validate() const;
};

/// The points that are not isolated, in the same order. Use it on the cloud of one keyframe before
/// it is merged with others: no edge of its depth map supports an isolated point.
///
/// Distances are computed in float, relative to the median position: they are exact to 1e-7 of the
/// extent of the cloud at any distance from the origin of the world.
/// @throws std::invalid_argument where the options are not valid, or a point is not finite or
/// too far from the others for floats.
std::vector<CloudPoint> removeOutliers(std::vector<CloudPoint> points,
                                       const OutlierRemovalOptions& options);

}  // namespace efm
