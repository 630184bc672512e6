// SPDX-License-Identifier: BSD-3-Clause
#include "maps/cloud/map_point.h"

#include <pcl/common/io.h>
#include <pcl/point_types.h>

#include <algorithm>
#include <cmath>
#include <utility>

namespace efm {
namespace {

/// The distance to the next larger float.
double floatStepAt(double coordinate) {
  const auto rounded = static_cast<float>(std::abs(coordinate));
  constexpr float kInfinity = std::numeric_limits<float>::infinity();
  return static_cast<double>(std::nextafter(rounded, kInfinity) - rounded);
}

/// See `coarseStepOf`.
/// @param reaches the largest coordinate of each point.
std::optional<double> coarseStepAt(std::vector<double> reaches, double resolution_m) {
  if (reaches.empty()) return std::nullopt;
  const auto at = reaches.end() - 1 - static_cast<std::ptrdiff_t>(reaches.size() / 1000);
  std::nth_element(reaches.begin(), at, reaches.end());
  const double step_m = floatStepAt(*at);
  return step_m > 0.1 * resolution_m ? std::optional(step_m) : std::nullopt;
}

/// The origin of a cloud's points.
Eigen::Vector3d originOf(const std::vector<CloudPoint>& points, double resolution_m) {
  std::vector<double> reaches;
  reaches.reserve(points.size());
  for (const CloudPoint& point : points) {
    reaches.push_back(point.p_world.cwiseAbs().maxCoeff());
  }
  if (!coarseStepAt(std::move(reaches), resolution_m)) return Eigen::Vector3d::Zero();
  // The step of floats from x to 2 x is at most x / 2^23.
  const double unit_m = std::pow(10, std::floor(std::log10(0.1 * resolution_m * (1 << 23))));
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

std::optional<double> coarseStepOf(const MapCloud& cloud, double resolution_m) {
  std::vector<double> reaches;
  reaches.reserve(cloud.size());
  for (const MapPoint& point : cloud) {
    reaches.push_back(positionIn(cloud, point).cwiseAbs().maxCoeff());
  }
  return coarseStepAt(std::move(reaches), resolution_m);
}

pcl::PointCloud<pcl::PointXYZI>::Ptr xyziCloudOf(const MapCloud& cloud) {
  auto copy = pcl::make_shared<pcl::PointCloud<pcl::PointXYZI>>();
  pcl::copyPointCloud(cloud, *copy);
  return copy;
}

}  // namespace efm
