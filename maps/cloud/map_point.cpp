// SPDX-License-Identifier: BSD-3-Clause
#include "maps/cloud/map_point.h"

#include <pcl/common/io.h>
#include <pcl/point_types.h>

#include <algorithm>
#include <cmath>

namespace efm {
namespace {

/// See `coarseStepOf`.
/// @param position_of p_world of a point.
template <typename Points, typename Position>
std::optional<double> coarseStepIn(const Points& points, Position position_of,
                                   double resolution_m) {
  if (points.empty()) return std::nullopt;
  std::vector<double> reaches;  // the largest coordinate of each point
  reaches.reserve(points.size());
  for (const auto& point : points) reaches.push_back(position_of(point).cwiseAbs().maxCoeff());
  const auto at = reaches.end() - 1 - static_cast<std::ptrdiff_t>(reaches.size() / 1000);
  std::nth_element(reaches.begin(), at, reaches.end());
  return coarseStepAt(*at, resolution_m);
}

/// Returns the origin of a cloud's points.
Eigen::Vector3d originOf(const std::vector<CloudPoint>& points, double resolution_m) {
  const auto position_of = [](const CloudPoint& point) { return point.p_world; };
  if (!coarseStepIn(points, position_of, resolution_m)) return Eigen::Vector3d::Zero();
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
    made.probability = point.probability;
    made.first_keyframe = static_cast<std::uint32_t>(point.first_keyframe);
  }
  return cloud;
}

std::optional<double> coarseStepAt(double coordinate_m, double resolution_m) {
  const auto rounded = static_cast<float>(coordinate_m);
  constexpr float kInfinity = std::numeric_limits<float>::infinity();
  const auto step_m = static_cast<double>(std::nextafter(rounded, kInfinity) - rounded);
  return step_m > 0.1 * resolution_m ? std::optional(step_m) : std::nullopt;
}

std::optional<double> coarseStepOf(const MapCloud& cloud, double resolution_m) {
  const auto position_of = [&](const MapPoint& point) { return positionIn(cloud, point); };
  return coarseStepIn(cloud, position_of, resolution_m);
}

pcl::PointCloud<pcl::PointXYZI>::Ptr xyziCloudOf(const MapCloud& cloud) {
  auto copy = pcl::make_shared<pcl::PointCloud<pcl::PointXYZI>>();
  pcl::copyPointCloud(cloud, *copy);
  return copy;
}

}  // namespace efm
