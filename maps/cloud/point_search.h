// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <memory>
#include <vector>

#include "maps/cloud/cloud_point.h"

namespace efm {

// The searches of PCL. They work on floats, which are precise near the origin only.

/// The median of each coordinate. Few points far away do not move it, unlike the mean.
/// @param points at least one.
/// @throws std::invalid_argument naming a point that is not finite.
Eigen::Vector3d medianPosition(const std::vector<CloudPoint>& points);

/// The positions relative to `origin`, in the same order.
/// @throws std::invalid_argument naming a point that is not finite, or so far from the origin that
/// a float cannot hold the square of the distance.
std::vector<Eigen::Vector3f> offsetsFrom(const Eigen::Vector3d& origin,
                                         const std::vector<CloudPoint>& points);

/// A k-d tree.
class PointTree {
 public:
  struct Neighbor {
    std::size_t index = 0;
    float squared_distance = 0;
  };

  /// @param points at least one, all finite.
  explicit PointTree(const std::vector<Eigen::Vector3f>& points);
  ~PointTree();

  /// @param point finite.
  Neighbor nearest(const Eigen::Vector3f& point) const;

 private:
  struct Tree;
  std::unique_ptr<Tree> tree_;
};

/// The ascending indices of the points that have at least `min_neighbors` others within the radius.
std::vector<std::size_t> indicesWithNeighbors(const std::vector<Eigen::Vector3f>& points,
                                              double radius, int min_neighbors);

}  // namespace efm
