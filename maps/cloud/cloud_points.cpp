// SPDX-License-Identifier: BSD-3-Clause
#define PCL_NO_PRECOMPILE  // see EfmPcl.cmake
#include "maps/cloud/cloud_points.h"

#include <pcl/filters/radius_outlier_removal.h>
#include <pcl/kdtree/kdtree_flann.h>
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>

#include <algorithm>
#include <stdexcept>

#include "mapping/base/option.h"
#include "mapping/base/text.h"
#include "mapping/depth/peak_fit.h"

namespace efm {

namespace {

/// Returns a text for messages, with all digits: "(1, 2.5, -3)".
std::string positionText(const CloudPoint& point) {
  NumberText text;
  text << "(" << point.p_world.x() << ", " << point.p_world.y() << ", " << point.p_world.z() << ")";
  return text.str();
}

void requireFinite(const CloudPoint& point) {
  if (point.p_world.allFinite()) return;
  throw std::invalid_argument("point " + positionText(point) + ": the position is not finite");
}

pcl::PointCloud<pcl::PointXYZ>::Ptr pclCloudOf(const std::vector<Eigen::Vector3f>& points) {
  auto cloud = pcl::make_shared<pcl::PointCloud<pcl::PointXYZ>>();
  cloud->reserve(points.size());
  for (const Eigen::Vector3f& point : points) cloud->push_back({point.x(), point.y(), point.z()});
  return cloud;
}

}  // namespace

std::string pointText(const CloudPoint& point) {
  NumberText text;
  text << positionText(point) << " with confidence " << point.confidence;
  return text.str();
}

std::vector<CloudPoint> removeOutliers(std::vector<CloudPoint> points,
                                       const OutlierRemovalOptions& options) {
  options.validate();
  if (options.outlier_radius_m == 0 || points.empty()) return points;
  pcl::RadiusOutlierRemoval<pcl::PointXYZ> filter;
  filter.setInputCloud(pclCloudOf(offsetsFrom(medianPosition(points), points)));
  filter.setRadiusSearch(options.outlier_radius_m);
  filter.setMinNeighborsInRadius(options.outlier_min_neighbors);
  pcl::Indices kept;
  filter.filter(kept);  // ascending
  std::vector<CloudPoint> inliers;
  for (const pcl::index_t index : kept) inliers.push_back(points[static_cast<std::size_t>(index)]);
  return inliers;
}

Eigen::Vector3d medianPosition(const std::vector<CloudPoint>& points) {
  for (const CloudPoint& point : points) requireFinite(point);
  Eigen::Vector3d median;
  std::vector<double> values(points.size());
  for (int axis = 0; axis < 3; ++axis) {
    std::transform(points.begin(), points.end(), values.begin(),
                   [axis](const CloudPoint& point) { return point.p_world[axis]; });
    median[axis] = upperMedian(values);
  }
  return median;
}

std::vector<Eigen::Vector3f> offsetsFrom(const Eigen::Vector3d& origin,
                                         const std::vector<CloudPoint>& points) {
  constexpr float kMaxOffset = 1e18F;  // its square is a float
  std::vector<Eigen::Vector3f> offsets;
  offsets.reserve(points.size());
  for (const CloudPoint& point : points) {
    requireFinite(point);
    offsets.push_back((point.p_world - origin).cast<float>());
    if (!(offsets.back().cwiseAbs().maxCoeff() < kMaxOffset)) {
      throw std::invalid_argument("point " + positionText(point) + ": too far from the others");
    }
  }
  return offsets;
}

struct PointTree::Tree {
  pcl::KdTreeFLANN<pcl::PointXYZ> flann;
};

PointTree::PointTree(const std::vector<Eigen::Vector3f>& points) : tree_(new Tree) {
  tree_->flann.setInputCloud(pclCloudOf(points));
}

PointTree::~PointTree() = default;

PointTree::Neighbor PointTree::nearest(const Eigen::Vector3f& point) const {
  pcl::Indices index(1);
  std::vector<float> squared_distance(1);
  tree_->flann.nearestKSearch({point.x(), point.y(), point.z()}, 1, index, squared_distance);
  return {static_cast<std::size_t>(index.front()), squared_distance.front()};
}

}  // namespace efm
