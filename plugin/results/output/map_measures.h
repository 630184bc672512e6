// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "mapping/geometry/trajectory.h"
#include "maps/cloud/map_point.h"

namespace efm {

/// A box around points of a map, in metres, frame `world`.
struct MapExtent {
  Eigen::Vector3d min_m = Eigen::Vector3d::Zero();
  Eigen::Vector3d max_m = Eigen::Vector3d::Zero();
};

/// @param outside the fraction of the points that lie outside, at each end of each axis; 0 for the
/// box around all of them.
/// @return nothing without points.
std::optional<MapExtent> extentOf(const MapCloud& cloud, double outside = 0);

/// How far the refinement moved the keyframes' poses.
struct PoseShift {
  double median_m = 0;
  double max_m = 0;
  double median_rad = 0;
  double max_rad = 0;
};

/// @param before and `after`: poses of the same keyframes, in the same order.
PoseShift shiftBetween(const std::vector<StampedPose>& before,
                       const std::vector<StampedPose>& after);

}  // namespace efm
