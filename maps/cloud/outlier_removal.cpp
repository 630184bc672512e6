// SPDX-License-Identifier: BSD-3-Clause
#include "maps/cloud/outlier_removal.h"

#include "mapping/base/named_choice.h"
#include "maps/cloud/point_search.h"

namespace efm {

void OutlierRemovalOptions::validate() const {
  requireOption(outlier_radius_m == 0 || (outlier_radius_m >= 1e-6 && outlier_radius_m <= 1e6),
                "outlier_radius_m", outlier_radius_m, "0 or from 1e-6 to 1e6 (metres)");
  requireOption(outlier_min_neighbors >= 1 && outlier_min_neighbors <= 10000,
                "outlier_min_neighbors", outlier_min_neighbors, "from 1 to 10000");
}

std::vector<CloudPoint> removeOutliers(std::vector<CloudPoint> points,
                                       const OutlierRemovalOptions& options) {
  options.validate();
  if (options.outlier_radius_m == 0 || points.empty()) return points;
  const auto offsets = offsetsFrom(medianPosition(points), points);
  std::vector<CloudPoint> inliers;
  for (const std::size_t index :
       indicesWithNeighbors(offsets, options.outlier_radius_m, options.outlier_min_neighbors)) {
    inliers.push_back(points[index]);
  }
  return inliers;
}

}  // namespace efm
