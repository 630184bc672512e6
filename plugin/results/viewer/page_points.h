// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "maps/cloud/map_point.h"

namespace efm {

/// A point of the page, `kBytes` bytes, little-endian: the position (x, y, z: 2 bytes each), the
/// confidence (1), the support (1), the first keyframe (2).
struct PagePoint {
  static constexpr std::size_t kBytes = 10;

  std::uint16_t cell[3] = {};   ///< p_world = origin + step * cell, per axis.
  std::uint8_t confidence = 0;  ///< Logarithmic between two values of `PagePoints`.
  std::uint8_t support = 0;     ///< Number of keyframes, at most 255.
  std::uint16_t keyframe = 0;   ///< The first one, divided by `keyframe_step`, rounded down.

  void appendTo(std::vector<std::uint8_t>& bytes) const;
};

/// The points of a map as the page has them: quantised, at most `limit` of them. Where the map has
/// more, each cell of a grid keeps its point with the highest support, and among these the one with
/// the highest confidence. The order is that of a walk through the map with a long stride: any
/// first part of the points covers the whole map evenly.
class PagePoints {
 public:
  static constexpr std::size_t kDefaultLimit = 2'000'000;

  /// Keeps a reference to the cloud. Memory: 4 bytes per point of the page, and while points are
  /// thinned 4 bytes per cell of a hash table, twice the limit or more.
  /// @param cloud all finite, with confidences above 0.
  /// @param voxel_size_m of the map. Above 0.
  explicit PagePoints(const MapCloud& cloud, double voxel_size_m,
                      std::size_t limit = kDefaultLimit);

  std::size_t size() const { return cloud_.size() <= limit_ ? cloud_.size() : kept_.size(); }
  /// @param i below `size`.
  PagePoint at(std::size_t i) const;

  /// The edge of the grid's cells where points were thinned, otherwise 0. Metres.
  double thinned_m() const { return thinned_m_; }
  /// The smallest coordinates, frame `world`, metres.
  const Eigen::Vector3d& origin_m() const { return origin_m_; }
  /// The positions' resolution: the extent over 65535. Metres.
  const Eigen::Vector3d& step_m() const { return step_m_; }
  /// The confidences of the bytes 0 and 255: that of the lowest and of the highest percent.
  float lowConfidence() const { return low_confidence_; }
  float highConfidence() const { return high_confidence_; }
  std::uint64_t keyframeStep() const { return keyframe_step_; }

 private:
  double countCells(double cell_m) const;
  bool thin(double cell_m);
  void findConfidences();

  const MapCloud& cloud_;
  std::size_t limit_;
  std::vector<std::uint32_t> kept_;  // indices, where points were thinned
  double thinned_m_ = 0;
  std::size_t stride_ = 1;
  Eigen::Vector3d origin_m_ = Eigen::Vector3d::Zero();
  Eigen::Vector3d step_m_ = Eigen::Vector3d::Zero();
  float low_confidence_ = 1;
  float high_confidence_ = 1;
  std::uint64_t keyframe_step_ = 1;
};

}  // namespace efm
