// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>

#include <cstddef>
#include <cstdint>
#include <limits>
#include <map>
#include <vector>

#include "mapping/geometry/rigid3.h"
#include "mapping/keyframes/keyframe_depth_map.h"
#include "maps/cloud/cloud_points.h"
#include "maps/cloud/global_cloud.h"
#include "maps/cloud/map_point.h"

namespace efm {

/// Returns the points of a keyframe, p_ref = Z * K^-1 (x, y, 1)^T: one for each pixel with a depth
/// and a confidence above 0, row by row. sigma_Z = Z^2 * sigma_(1/Z): Z is the inverse of the
/// inverse depth, whose variance the keyframe has.
std::vector<ViewPoint> viewPoints(const KeyframeDepthMap& keyframe);

/// Returns the points of the single cameras of a keyframe, one camera after the other: late fusion,
/// the baseline for fused DSIs (Ghosh and Gallego 2022, Sec. 3.3.1). Empty if the keyframe has no
/// maps of single cameras.
/// @throws std::invalid_argument as `viewPoints` does.
std::vector<ViewPoint> lateFusionPoints(const KeyframeDepthMap& keyframe);

/// Returns the points p_world = T_world_ref * p_ref, each with a support of 1.
std::vector<CloudPoint> pointsInWorld(const std::vector<ViewPoint>& points,
                                      const Rigid3& T_world_ref);

/// Returns `viewPoints` in the world, as a cloud of PCL.
/// @param resolution_m see `mapCloudOf`.
MapCloud::ConstPtr keyframeCloud(const KeyframeDepthMap& keyframe, double resolution_m = 0.01);

/// The global cloud with keyframes that move. Each keyframe keeps its points in its own view; it is
/// removed and inserted again with its new pose. The cost of a move does not grow with the map.
/// Keyframes that cannot move any more are merged into the map for good. Not thread-safe.
class RefinedCloud {
 public:
  static constexpr std::size_t kAll = std::numeric_limits<std::size_t>::max();

  /// @param movable minimum number of newest keyframes that may move; 0: none may. Their points are
  /// kept, 20 bytes each.
  RefinedCloud(const GlobalCloudOptions& options, std::size_t movable)
      : cloud_(options), movable_(movable) {}

  /// Inserts a keyframe of an earlier map. It never moves.
  /// @throws std::invalid_argument as GlobalCloud::insert does, and after an `insert`.
  void insertFixed(const std::vector<CloudPoint>& points, const Rigid3& T_world_ref);
  /// Inserts the next keyframe. @throws as `insertFixed`. The cloud is unchanged after any error.
  void insert(std::vector<ViewPoint> points, const Rigid3& T_world_ref);
  /// Removes the keyframe that was inserted last, if there is one.
  void removeNewest();

  /// Removes the points of a keyframe that is one of the last `GlobalCloud::kMaxNumberDifference`.
  /// It keeps its number and pose, and checks no other keyframe.
  void removePoints(std::size_t keyframe);

  /// See GlobalCloud::keepSlab.
  void keepSlab(std::int64_t begin, std::int64_t end) { cloud_.keepSlab(begin, end); }

  /// Requests new poses for keyframes, by their numbers. `applyPending` moves them. A request for a
  /// keyframe that cannot move any more is dropped: the keyframe keeps its last pose.
  /// @throws std::invalid_argument if a keyframe was not inserted, or keyframes are not movable.
  /// Then nothing is requested.
  void move(std::map<std::size_t, Rigid3> T_world_ref);
  /// Moves keyframes to their requested poses if a point is wrong by more than the tolerance: the
  /// oldest keyframe first, at most `max_count` keyframes. A tolerance of 0 moves all, bit for bit.
  /// @throws std::invalid_argument as GlobalCloud::insert does. Then that keyframe keeps its old
  /// pose, and its request is dropped.
  void applyPending(double tolerance_m, std::size_t max_count = kAll);

  const GlobalCloud& cloud() const { return cloud_; }
  /// The poses of the keyframes in the cloud, without the keyframes of an earlier map.
  const std::vector<Rigid3>& T_world_ref() const { return T_world_ref_; }

 private:
  void put(std::size_t keyframe, const Rigid3& T_world_ref);
  void forgetNewest();
  void finalize();
  void freeze(std::size_t below);

  struct KeptPoints {
    std::vector<ViewPoint> points;
    double radius_m = 0;  // the maximum distance of a point from the view
  };

  GlobalCloud cloud_;
  std::size_t movable_;
  std::size_t fixed_ = 0;        // keyframes of an earlier map
  std::size_t frozen_ = 0;       // the first keyframes, which cannot move any more
  std::uint64_t next_look_ = 0;  // see finalize()
  std::vector<Rigid3> T_world_ref_;
  std::vector<KeptPoints> kept_;           // one per T_world_ref_ if keyframes move; frozen: none
  std::map<std::size_t, Rigid3> pending_;  // requested poses
};

}  // namespace efm
