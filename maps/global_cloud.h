// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <unordered_map>
#include <unordered_set>
#include <vector>

#include "maps/cloud_point.h"

namespace efm {

struct GlobalCloudOptions {
  /// Edge of a voxel in metres; points in one voxel become one. Range: 1e-6 to 1000. The default
  /// keeps the detail of a desk, where a depth plane is about a centimetre from the next.
  double voxel_size_m = 0.01;
  /// Export what at least so many keyframes saw. Range: at least 1, which keeps everything.
  int min_keyframes = 1;

  /// @throws std::invalid_argument naming the field, its value and the allowed range.
  void validate() const;
};

/// The map: all keyframes' points in the world, one per occupied voxel.
///
/// Each voxel keeps apart the sums that each keyframe put there. Its point is the mean position of
/// all its points weighted by their confidence, its confidence their mean, its support the number
/// of keyframes. Totals are formed in the order of keyframe numbers, so the map does not depend on
/// the order of insertion, bit for bit.
///
/// Voxel (i, j, k) holds [i, i + 1) x [j, j + 1) x [k, k + 1) times the voxel size; indices are 64
/// bits wide. Not thread-safe.
class GlobalCloud {
 public:
  /// @throws std::invalid_argument where the options are not valid.
  explicit GlobalCloud(const GlobalCloudOptions& options = {});

  /// Puts a keyframe's points into the map. Cost: that of the points, whatever the size of the map.
  /// @param keyframe its number: each is inserted once.
  /// @throws std::invalid_argument where the number was inserted before, a point is not finite, has
  /// no confidence above 0, or lies outside the range of voxel indices: nothing is inserted then.
  void insert(std::uint64_t keyframe, const std::vector<CloudPoint>& points);

  /// The points that at least `min_keyframes` of the options support, sorted by voxel (x, y, z).
  std::vector<CloudPoint> points() const { return points(options_.min_keyframes); }
  std::vector<CloudPoint> points(int min_keyframes) const;

  std::size_t voxels() const { return voxels_.size(); }
  std::size_t keyframes() const { return keyframes_.size(); }
  const GlobalCloudOptions& options() const { return options_; }

 private:
  struct VoxelIndex {
    std::int64_t x = 0, y = 0, z = 0;
    bool operator==(const VoxelIndex& o) const { return x == o.x && y == o.y && z == o.z; }
    bool operator<(const VoxelIndex& o) const;
  };
  struct VoxelHash {
    std::size_t operator()(const VoxelIndex& index) const;
  };
  /// What one keyframe put into a voxel. Offsets are from the voxel's corner: sums of coordinates
  /// would lose the precision that the voxel needs.
  struct Sums {
    std::uint64_t keyframe = 0;
    std::uint64_t count = 0;
    double weight = 0;
    Eigen::Vector3d weighted_offset = Eigen::Vector3d::Zero();
  };
  struct PlacedPoint {
    VoxelIndex index;
    Eigen::Vector3d offset;
    double weight = 0;
  };

  PlacedPoint place(const CloudPoint& point) const;
  CloudPoint pointOf(const VoxelIndex& index, const std::vector<Sums>& sums) const;

  GlobalCloudOptions options_;
  std::unordered_map<VoxelIndex, std::vector<Sums>, VoxelHash> voxels_;  // by keyframe number
  std::unordered_set<std::uint64_t> keyframes_;
};

}  // namespace efm
