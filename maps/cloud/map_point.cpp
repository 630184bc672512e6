// SPDX-License-Identifier: BSD-3-Clause
#include "maps/cloud/map_point.h"

#include <pcl/common/io.h>
#include <pcl/point_types.h>

#include <algorithm>
#include <cmath>

namespace efm {

CloudOrigin::CloudOrigin(double resolution_m)
    : resolution_m_(resolution_m),
      // The step of floats from x to 2 x is at most x / 2^23.
      unit_m_(std::pow(10, std::floor(std::log10(0.1 * resolution_m * (1 << 23))))) {}

constexpr double kNear = 0.4;  // of a unit

void CloudOrigin::add(const std::vector<CloudPoint>& points) {
  points_ += points.size();
  for (const CloudPoint& point : points) {
    const double reach_m = point.p_world.cwiseAbs().maxCoeff();
    if (reach_m < kNear * unit_m_) continue;  // it rounds to 0, and floats are fine enough
    ++far_;
    if (coarseStepAt(reach_m, resolution_m_)) ++coarse_;
    const Eigen::Array3d rounded = (point.p_world / unit_m_).array().round();
    for (std::size_t axis = 0; axis < 3; ++axis) {
      ++counts_[axis][rounded[static_cast<Eigen::Index>(axis)]];
    }
  }
}

Eigen::Vector3f CloudOrigin::origin() const {
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();
  if (coarse_ <= points_ / 1000) return origin.cast<float>();  // a few wrong points lie anywhere
  for (std::size_t axis = 0; axis < 3; ++axis) {
    std::map<double, std::size_t> counts = counts_[axis];
    counts[0] += points_ - far_;
    auto median = counts.begin();
    for (std::size_t below = median->second; below <= points_ / 2; below += median->second) {
      ++median;
    }
    origin[static_cast<Eigen::Index>(axis)] = median->first * unit_m_;
  }
  return origin.cast<float>();
}

MapCloud::Ptr mapCloudOf(const std::vector<CloudPoint>& points, double resolution_m) {
  CloudOrigin origin(resolution_m);
  origin.add(points);
  return mapCloudAt(origin.origin(), points);
}

MapCloud::Ptr mapCloudAt(const Eigen::Vector3f& origin_m, const std::vector<CloudPoint>& points) {
  auto cloud = pcl::make_shared<MapCloud>();
  cloud->sensor_origin_.head<3>() = origin_m;
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
  if (cloud.empty()) return std::nullopt;
  std::vector<double> reaches;  // the largest coordinate of each point
  reaches.reserve(cloud.size());
  for (const MapPoint& p : cloud) reaches.push_back(positionIn(cloud, p).cwiseAbs().maxCoeff());
  const auto at = reaches.end() - 1 - static_cast<std::ptrdiff_t>(reaches.size() / 1000);
  std::nth_element(reaches.begin(), at, reaches.end());
  return coarseStepAt(*at, resolution_m);
}

pcl::PointCloud<pcl::PointXYZI>::Ptr xyziCloudOf(const MapCloud& cloud) {
  auto copy = pcl::make_shared<pcl::PointCloud<pcl::PointXYZI>>();
  pcl::copyPointCloud(cloud, *copy);
  return copy;
}

}  // namespace efm
