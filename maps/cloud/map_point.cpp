// SPDX-License-Identifier: BSD-3-Clause
#include "maps/cloud/map_point.h"

#include <pcl/common/io.h>
#include <pcl/point_types.h>

#include <algorithm>
#include <cmath>

#include "maps/cloud/point_search.h"

namespace efm {
namespace {

/// The distance to the next larger float.
double floatStepAt(double coordinate) {
  const auto rounded = static_cast<float>(std::abs(coordinate));
  constexpr float kInfinity = std::numeric_limits<float>::infinity();
  return static_cast<double>(std::nextafter(rounded, kInfinity) - rounded);
}

/// The origin of a cloud's points.
Eigen::Vector3d originOf(const std::vector<CloudPoint>& points, double resolution_m) {
  if (points.empty()) return Eigen::Vector3d::Zero();
  double largest_m = 0;
  for (const CloudPoint& point : points) {
    largest_m = std::max(largest_m, point.p_world.cwiseAbs().maxCoeff());
  }
  const double max_step_m = 0.1 * resolution_m;
  if (!(floatStepAt(largest_m) > max_step_m)) return Eigen::Vector3d::Zero();
  // The step of floats from x to 2 x is at most x / 2^23.
  const double unit_m = std::pow(10, std::floor(std::log10(max_step_m * (1 << 23))));
  return (medianPosition(points) / unit_m).array().round() * unit_m;
}

}  // namespace

MapCloud::Ptr mapCloudOf(const std::vector<CloudPoint>& points, double resolution_m) {
  auto cloud = pcl::make_shared<MapCloud>();
  cloud->sensor_origin_.head<3>() = originOf(points, resolution_m).cast<float>();
  const Eigen::Vector3d origin = cloud->sensor_origin_.head<3>().cast<double>();
  cloud->reserve(points.size());
  for (const CloudPoint& point : points) {
    MapPoint& made = cloud->emplace_back();
    made.getVector3fMap() = (point.p_world - origin).cast<float>();
    made.intensity = point.confidence;
    made.support = point.support;
    made.sigma = point.sigma;
    made.first_keyframe = static_cast<std::uint32_t>(point.first_keyframe);
  }
  return cloud;
}

pcl::PointCloud<pcl::PointXYZI>::Ptr xyziCloudOf(const MapCloud& cloud) {
  auto copy = pcl::make_shared<pcl::PointCloud<pcl::PointXYZI>>();
  pcl::copyPointCloud(cloud, *copy);
  return copy;
}

}  // namespace efm
