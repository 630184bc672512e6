// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <vector>

#include "mapping/geometry/rigid3.h"
#include "maps/cloud/cloud_point.h"
#include "maps/cloud/keyframe_consistency.h"
#include "maps/cloud/outlier_removal.h"
#include "maps/cloud/visibility_grid.h"

namespace efm {

struct GlobalCloudOptions {
  /// Edge of a voxel in metres; points in one voxel become one. Range: 1e-6 to 1000. The default
  /// keeps the detail of a desk, where a depth plane is about a centimetre from the next.
  double voxel_size_m = 0.01;
  /// Export what at least so many keyframes saw. Range: at least 1, which keeps everything.
  int min_keyframes = 1;
  /// What of each keyframe stays outside.
  OutlierRemovalOptions outliers = {};
  /// What keyframes say of each other's points.
  ConsistencyOptions consistency = {};

  /// @throws std::invalid_argument naming the field, its value and the allowed range.
  void validate() const;
};

/// The map: all keyframes' points in the world, one per occupied voxel.
///
/// Each keyframe keeps apart the sums that it puts into its voxels, and totals are formed only when
/// points are asked for: a voxel's point is the mean position of all its points weighted by their
/// confidence, its confidence their mean, its support the number of keyframes that have a point in
/// it or support one that has. So neither inserting nor removing a keyframe touches what the others
/// put there, and neither costs more in a larger map.
///
/// A keyframe that is inserted with its pose is compared with those whose numbers are at most
/// `kReach` from its own, each with the other's points (VisibilityGrid). What they say is kept in
/// two bits per voxel of a keyframe and other keyframe, set when the later of the two comes and
/// cleared when one goes. By these bits keyframes support each other, and what others look through
/// and none supports is left out.
///
/// Totals are formed in the order of keyframe numbers: the map depends on what is in it, not
/// on the order in which that came and what has left, bit for bit.
///
/// Voxel (i, j, k) holds [i, i + 1) x [j, j + 1) x [k, k + 1) times the voxel size; indices are 64
/// bits wide. Not thread-safe.
class GlobalCloud {
 public:
  /// @throws std::invalid_argument where the options are not valid.
  explicit GlobalCloud(const GlobalCloudOptions& options = {});

  /// Keyframes whose numbers differ by more are not compared with each other.
  static constexpr int kReach = 8;

  /// Puts a keyframe's points into the map, less the outliers among them: `removeOutliers` with
  /// this map's options sees the keyframe alone. Cost: that of sorting the points and of comparing
  /// them with at most 2 `kReach` others, whatever the size of the map.
  /// @param keyframe its number, by which it can be removed; in the map once.
  /// @param T_world_ref pose of the view that saw the points; without it the keyframe says nothing
  /// of other keyframes' points, but they of its.
  /// @throws std::invalid_argument where the number is in the map, a point is not finite, or one
  /// that is no outlier has no confidence above 0 or lies outside the range of voxel indices:
  /// nothing is inserted then.
  void insert(std::uint64_t keyframe, const std::vector<CloudPoint>& points,
              const std::optional<Rigid3>& T_world_ref = std::nullopt);

  /// Whether points lie where the map has voxels.
  /// @throws std::invalid_argument as `insert` does of a point.
  void requireInsertable(const std::vector<CloudPoint>& points) const;

  /// Takes a keyframe out: the map is as if it had never been inserted, its memory is given back,
  /// and its number is free for another insertion, of a refined keyframe for example. Cost: at most
  /// that of its points and of those that it was compared with.
  /// @throws std::invalid_argument where the number is not in the map.
  void remove(std::uint64_t keyframe);

  /// The points that at least `min_keyframes` of the options support, sorted by voxel (x, y, z).
  /// Cost: that of merging what the keyframes put there.
  std::vector<CloudPoint> points() const { return points(options_.min_keyframes); }
  std::vector<CloudPoint> points(int min_keyframes) const;

  /// Voxels with something that is not left out. Costs about what `points` does.
  std::size_t voxels() const;
  std::size_t keyframes() const { return keyframes_.size(); }
  const GlobalCloudOptions& options() const { return options_; }

 private:
  struct VoxelIndex {
    std::int64_t x = 0, y = 0, z = 0;
    bool operator==(const VoxelIndex& o) const { return x == o.x && y == o.y && z == o.z; }
    bool operator<(const VoxelIndex& o) const;
  };
  struct PlacedPoint {
    VoxelIndex index;
    Eigen::Vector3d offset;
    double weight = 0;
  };
  /// What one keyframe put into a voxel, or all of them. Offsets are from the voxel's corner: sums
  /// of coordinates would lose the precision that the voxel needs.
  struct Sums {
    VoxelIndex index;
    std::uint64_t count = 0;
    double weight = 0;
    Eigen::Vector3d weighted_offset = Eigen::Vector3d::Zero();

    void add(const PlacedPoint& point);
    void add(const Sums& other);
  };

  /// What others say of a keyframe's voxel: a bit for each number within reach, below and above.
  struct Verdicts {
    std::uint16_t supports = 0;
    std::uint16_t looks_through = 0;
  };
  struct Keyframe {
    std::vector<Sums> voxels;             // sorted
    std::vector<Verdicts> verdicts;       // beside `voxels`; empty without consistency
    std::optional<VisibilityGrid> sight;  // with consistency, where the pose is known
  };

  PlacedPoint place(const CloudPoint& point) const;
  std::vector<Sums> voxelsOf(const std::vector<CloudPoint>& points) const;
  Eigen::Vector3d positionOf(const Sums& sums) const;
  CloudPoint pointOf(const Sums& total, std::uint32_t support) const;
  void judge(Keyframe& judged, const Keyframe& by, unsigned bit) const;
  template <typename Visit>
  void visitWithinReach(std::uint64_t number, const Visit& visit);
  void compareWithOthers(std::uint64_t number);
  bool leftOut(const Keyframe& keyframe, std::size_t voxel) const;
  template <typename Visit>
  void visitVoxels(const Visit& visit) const;

  GlobalCloudOptions options_;
  std::map<std::uint64_t, Keyframe> keyframes_;  // by number
};

}  // namespace efm
