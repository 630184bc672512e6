// SPDX-License-Identifier: BSD-3-Clause
#include "maps/outlier_removal.h"

#include <pcl/filters/radius_outlier_removal.h>
#include <pcl/point_types.h>

#include <algorithm>
#include <stdexcept>

#include "mapping/option_check.h"
#include "maps/point_text.h"

namespace efm {
namespace {

[[noreturn]] void refusePoint(const CloudPoint& point, const std::string& why) {
  throw std::invalid_argument(pointText(point) + ": " + why);
}

/// The median of each coordinate: unlike the mean or the middle of the bounds, a stray point far
/// away does not carry it from where the points are.
Eigen::Vector3d middleOf(const std::vector<CloudPoint>& points) {
  Eigen::Vector3d middle;
  std::vector<double> values(points.size());
  for (int axis = 0; axis < 3; ++axis) {
    std::transform(points.begin(), points.end(), values.begin(),
                   [axis](const CloudPoint& point) { return point.p_world[axis]; });
    const auto half = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
    std::nth_element(values.begin(), half, values.end());
    middle[axis] = *half;
  }
  return middle;
}

pcl::PointCloud<pcl::PointXYZ>::Ptr aroundMiddle(const std::vector<CloudPoint>& points) {
  for (const CloudPoint& point : points) {
    if (!point.p_world.allFinite()) refusePoint(point, "the position is not finite");
  }
  const Eigen::Vector3d middle = middleOf(points);
  auto cloud = pcl::make_shared<pcl::PointCloud<pcl::PointXYZ>>();
  cloud->reserve(points.size());
  for (const CloudPoint& point : points) {
    const Eigen::Vector3f offset = (point.p_world - middle).cast<float>();
    // The search squares and adds.
    if (!(offset.cwiseAbs().maxCoeff() < 1e18F)) refusePoint(point, "too far from the others");
    cloud->push_back({offset.x(), offset.y(), offset.z()});
  }
  return cloud;
}

}  // namespace

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
  filter.setInputCloud(aroundMiddle(points));
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
