// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <pcl/point_cloud.h>
#include <pcl/point_types.h>

#include <Eigen/Core>
#include <vector>

#include "maps/cloud/cloud_point.h"

namespace efm {

/// For the sources of maps/ alone: PCL's searches work on floats, which are fine near the origin.

/// The median of each coordinate: unlike the mean or the middle of the bounds, a stray point far
/// away does not carry it from where the points are.
/// @param points at least one.
/// @throws std::invalid_argument naming a point that is not finite.
Eigen::Vector3d medianPosition(const std::vector<CloudPoint>& points);

/// The points as floats, seen from `middle`, in their order.
/// @throws std::invalid_argument naming a point that is not finite or too far from the middle for
/// its distance to be squared.
pcl::PointCloud<pcl::PointXYZ>::Ptr pclCloudAround(const Eigen::Vector3d& middle,
                                                   const std::vector<CloudPoint>& points);

}  // namespace efm
