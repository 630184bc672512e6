// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <map>
#include <optional>
#include <tuple>
#include <vector>

#include "mapping/base/option.h"
#include "mapping/geometry/rigid3.h"
#include "maps/cloud/cloud_points.h"
#include "maps/cloud/map_point.h"
#include "maps/cloud/visibility_grid.h"

namespace efm {

struct GlobalCloudOptions {
  /// Edge of a voxel in metres; the points in a voxel are merged. Range: 1e-6 to 1000. The default
  /// suits a desk, where depth planes are about a centimetre apart.
  double voxel_size_m = 0.01;
  /// Points with less support are not exported. Range: at least 1, which keeps all points.
  int min_keyframes = 1;
  /// Points of a keyframe that are not inserted.
  OutlierRemovalOptions outliers = {};
  /// The way in which keyframes check the points of other keyframes.
  ConsistencyOptions consistency = {};

  template <typename Self, typename Visit>
  static void fields(Self& self, Visit&& visit) {
    visit("voxel_size_m", self.voxel_size_m,
          Allowed::from(1e-6, 1000, "from 1e-6 to 1000 (metres)"));
    visit("min_keyframes", self.min_keyframes, Allowed::atLeast(1, "at least 1"));
    visit(self.outliers);
    visit(self.consistency);
  }
  void validate() const { requireFields(*this); }
};

/// The map: the points of all keyframes in the world, one per occupied voxel.
///
/// Each keyframe has its own voxels with the sums of its points. `points` merges them: the position
/// of a voxel is the mean of its points, weighted by their confidence. Its confidence is their mean
/// confidence. Its support is the number of keyframes that have a point in the voxel or support
/// such a point. Its first keyframe is the lowest of their numbers. So the cost of inserting or
/// removing a keyframe does not grow with the map.
///
/// The sigma of a voxel is that of its mean position, p = sum(w_i p_i) / sum(w_i). The depths of a
/// keyframe in a voxel come from the same edge, events and poses: their errors are taken as fully
/// correlated, so many of them are not more exact than one. Errors of two keyframes are taken as
/// independent. So sigma = sqrt(sum over keyframes of (sum of w_i sigma_i)^2) / sum(w_i). It is NaN
/// if the sigma of a point is not known. The probability of a voxel is the mean of its points,
/// weighted by their confidence; NaN if that of a point is not known.
///
/// Two keyframes whose numbers differ by at most `kMaxNumberDifference` check each other's points
/// (VisibilityGrid). Each voxel of a keyframe has two bits per other keyframe: one for support, one
/// for a free-space violation. `insert` sets them, and `remove` clears them. A voxel with too many
/// free-space violations and no support is excluded.
///
/// Keyframes are merged in the order of their numbers. So the map depends on its keyframes alone,
/// bit for bit: not on the order of insertion, and not on removed keyframes.
///
/// Voxel (i, j, k) covers [i, i + 1) x [j, j + 1) x [k, k + 1) times the voxel size. Indices have
/// 64 bits. Not thread-safe.
class GlobalCloud {
 public:
  explicit GlobalCloud(const GlobalCloudOptions& options = {}) : options_(options) {
    options_.validate();
  }

  /// Keyframes whose numbers differ by more do not check each other's points.
  static constexpr int kMaxNumberDifference = 8;

  /// Inserts the points of a keyframe without their outliers (`removeOutliers` on this keyframe
  /// alone). Cost: sorting the points, and checking them against at most 16 keyframes.
  /// @param keyframe the number of the keyframe; unique in the map.
  /// @param T_world_ref pose of the view that saw the points. Without a pose, the keyframe does not
  /// check the points of other keyframes.
  /// @throws std::invalid_argument if the number is in the map, a point is not finite, or an inlier
  /// has a confidence that is not above 0 or lies outside the range of voxel indices. Then the map
  /// is unchanged.
  void insert(std::uint64_t keyframe, const std::vector<CloudPoint>& points,
              const std::optional<Rigid3>& T_world_ref = std::nullopt);

  /// Replaces the points and the pose of a keyframe, as `remove` and `insert` do.
  /// @throws std::invalid_argument as `remove` and `insert`. Then the map is unchanged.
  void replace(std::uint64_t keyframe, const std::vector<CloudPoint>& points,
               const std::optional<Rigid3>& T_world_ref);

  /// Removes a keyframe. The map is as if it had never been inserted, and the number is free again.
  /// Cost: linear in the points of the keyframe and of the keyframes that it checked.
  void remove(std::uint64_t keyframe);

  /// Finalizes the keyframes below a number: merges them for good, so that memory and the cost of
  /// `points` grow with the voxels of the map, not with its keyframes. The map stays the same, bit
  /// for bit. Cost: linear in the merged voxels.
  /// @param below all keyframes below `below` + `kMaxNumberDifference` are in the map, or never
  /// will be: from now on `insert` rejects them, and `remove` and `replace` reject the keyframes
  /// below `below`. Keyframes from `below` on may change, but their verdicts on merged points stay.
  void finalize(std::uint64_t below);
  std::uint64_t finalizedBelow() const { return finalized_below_; }
  /// The numbers of voxels that `finalize` has merged, and that it would merge; the latter and 10
  /// for each keyframe, by its memory.
  std::size_t finalizedVoxels() const { return finalized_.size(); }
  std::size_t unfinalizedVoxels(std::uint64_t below) const;

  /// Keeps the voxels whose index x is in [begin, end) alone, from now on: a slab of a map that is
  /// too large for the memory. Their points are those of the whole map, bit for bit.
  void keepSlab(std::int64_t begin, std::int64_t end);
  /// Returns an index x that halves the finalized voxels; std::nullopt if they have a single one.
  std::optional<std::int64_t> middleX() const;

  /// Returns the points with a support of at least `min_keyframes`, sorted by voxel (x, y, z).
  /// Cost: merging the voxels of all keyframes.
  MapCloud::ConstPtr points() const { return points(options_.min_keyframes); }
  MapCloud::ConstPtr points(int min_keyframes) const;
  std::vector<CloudPoint> pointsInWorld(int min_keyframes) const;

  std::size_t keyframes() const { return finalized_keyframes_ + keyframes_.size(); }
  const GlobalCloudOptions& options() const { return options_; }

 private:
  struct VoxelIndex {
    std::int64_t x = 0, y = 0, z = 0;
    bool operator==(const VoxelIndex& o) const { return x == o.x && y == o.y && z == o.z; }
    bool operator<(const VoxelIndex& o) const {
      return std::tie(x, y, z) < std::tie(o.x, o.y, o.z);
    }
  };
  struct VoxelPoint {
    VoxelIndex index;
    Eigen::Vector3d offset;  // from the corner of the voxel, metres
    double weight = 0;
    double sigma = 0;  // metres
    double probability = 0;
  };
  /// The sums over the points in a voxel, of one keyframe or of all. Offsets are from the corner of
  /// the voxel: sums of coordinates far from the origin would lose digits.
  struct Sums {
    VoxelIndex index;
    std::uint64_t count = 0;
    double weight = 0;
    Eigen::Vector3d weighted_offset = Eigen::Vector3d::Zero();
    /// For one keyframe, the sum of weighted sigmas; for several, the root of its summed squares.
    double weighted_sigma = 0;
    double weighted_probability = 0;

    void add(const VoxelPoint& point);
    void add(const Sums& other);
  };

  /// Verdicts of other keyframes on a voxel: a bit for each of the 8 numbers below and above.
  struct Verdicts {
    std::uint16_t supports = 0;
    std::uint16_t free_space_violations = 0;
  };
  struct Keyframe {
    std::vector<Sums> voxels;            // sorted
    std::vector<Verdicts> verdicts;      // one per voxel; empty without consistency
    std::optional<VisibilityGrid> grid;  // with consistency, if the pose is known
  };

  /// A voxel of finalized keyframes. Its supporting keyframes are counted. The numbers near the
  /// first keyframe that is not final are known, because later keyframes may add the same supports.
  struct FinalizedVoxel {
    Sums sums;
    std::uint64_t first = 0;   ///< The lowest number of a keyframe that supports it.
    std::uint32_t older = 0;   ///< Supporters below `finalized_below_` - kMaxNumberDifference.
    std::uint16_t recent = 0;  ///< Supporters: a bit for each number from there on.
  };
  /// A voxel of all keyframes.
  struct MergedVoxel {
    Sums sums;
    std::uint64_t first = 0;
    std::uint32_t older = 0;                ///< Supporting keyframes that are not in `supporting`.
    std::vector<std::uint64_t> supporting;  ///< Numbers, ascending.

    std::size_t support() const { return older + supporting.size(); }
  };

  Keyframe keyframeOf(const std::vector<CloudPoint>& points,
                      const std::optional<Rigid3>& T_world_ref) const;
  VoxelPoint voxelPointOf(const CloudPoint& point) const;
  std::vector<Sums> voxelsOf(const std::vector<CloudPoint>& points) const;
  Eigen::Vector3d positionOf(const Sums& sums) const;
  CloudPoint pointOf(const MergedVoxel& voxel) const;
  void check(Keyframe& checked, const Keyframe& by, unsigned bit) const;
  template <typename Visit>
  void visitNeighbors(std::uint64_t number, const Visit& visit);
  void checkMutually(std::uint64_t number);
  void forgetVerdictsOf(std::uint64_t number);
  bool isExcluded(const Keyframe& keyframe, std::size_t voxel) const;
  template <typename Visit>
  void visitVoxels(std::uint64_t below, const Visit& visit) const;

  GlobalCloudOptions options_;
  std::int64_t slab_begin_ = std::numeric_limits<std::int64_t>::min();
  std::int64_t slab_end_ = std::numeric_limits<std::int64_t>::max();
  std::map<std::uint64_t, Keyframe> keyframes_;  // by number; without the finalized keyframes
  std::vector<FinalizedVoxel> finalized_;        // sorted
  std::uint64_t finalized_below_ = 0;            // keyframes below this number are final
  std::size_t finalized_keyframes_ = 0;
};

}  // namespace efm
