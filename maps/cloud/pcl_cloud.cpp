// SPDX-License-Identifier: BSD-3-Clause
#include "maps/cloud/pcl_cloud.h"

#include <algorithm>
#include <stdexcept>
#include <string>

#include "mapping/depth/median.h"
#include "maps/cloud/point_text.h"

namespace efm {
namespace {

[[noreturn]] void refusePoint(const CloudPoint& point, const std::string& why) {
  throw std::invalid_argument(pointText(point) + ": " + why);
}

void requireFinite(const CloudPoint& point) {
  if (!point.p_world.allFinite()) refusePoint(point, "the position is not finite");
}

}  // namespace

Eigen::Vector3d medianPosition(const std::vector<CloudPoint>& points) {
  for (const CloudPoint& point : points) requireFinite(point);
  Eigen::Vector3d middle;
  std::vector<double> values(points.size());
  for (int axis = 0; axis < 3; ++axis) {
    std::transform(points.begin(), points.end(), values.begin(),
                   [axis](const CloudPoint& point) { return point.p_world[axis]; });
    middle[axis] = upperMedian(values);
  }
  return middle;
}

pcl::PointCloud<pcl::PointXYZ>::Ptr pclCloudAround(const Eigen::Vector3d& middle,
                                                   const std::vector<CloudPoint>& points) {
  auto cloud = pcl::make_shared<pcl::PointCloud<pcl::PointXYZ>>();
  cloud->reserve(points.size());
  for (const CloudPoint& point : points) {
    requireFinite(point);
    const Eigen::Vector3f offset = (point.p_world - middle).cast<float>();
    // The search squares and adds.
    if (!(offset.cwiseAbs().maxCoeff() < 1e18F)) refusePoint(point, "too far from the others");
    cloud->push_back({offset.x(), offset.y(), offset.z()});
  }
  return cloud;
}

}  // namespace efm
