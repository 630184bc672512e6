// SPDX-License-Identifier: BSD-3-Clause
#include "maps/cloud/outlier_removal.h"

#include <pcl/filters/radius_outlier_removal.h>
#include <pcl/point_types.h>

#include "mapping/options/option_check.h"
#include "maps/cloud/pcl_cloud.h"

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
  pcl::RadiusOutlierRemoval<pcl::PointXYZ> filter;
  filter.setInputCloud(pclCloudAround(medianPosition(points), points));
  filter.setRadiusSearch(options.outlier_radius_m);
  filter.setMinNeighborsInRadius(options.outlier_min_neighbors);
  pcl::Indices kept;
  filter.filter(kept);  // ascending

  std::vector<CloudPoint> inliers;
  inliers.reserve(kept.size());
  for (const pcl::index_t index : kept) inliers.push_back(points[static_cast<std::size_t>(index)]);
  return inliers;
}

}  // namespace efm
