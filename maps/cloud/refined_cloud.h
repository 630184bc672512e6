// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <limits>
#include <map>
#include <vector>

#include "mapping/geometry/rigid3.h"
#include "maps/cloud/global_cloud.h"
#include "maps/cloud/keyframe_cloud.h"

namespace efm {

/// The global cloud with keyframes that move: each keeps its points as its own view sees them, and
/// is taken out and put back where it stands now. Moving some costs what these cost, whatever the
/// size of the map. Not thread-safe.
class RefinedCloud {
 public:
  /// @param movable whether keyframes will move: their points are kept then, 16 bytes each.
  /// @throws std::invalid_argument where the options are not valid.
  RefinedCloud(const GlobalCloudOptions& options, bool movable)
      : cloud_(options), movable_(movable) {}

  /// Puts a keyframe of an earlier map into the cloud, which never moves: before all others.
  /// @throws std::invalid_argument as GlobalCloud::insert does.
  void insertFixed(const std::vector<CloudPoint>& points, const Rigid3& T_world_ref);
  /// Puts the next keyframe into the cloud. @throws as `insertFixed`.
  void insert(std::vector<ViewPoint> points, const Rigid3& T_world_ref);

  /// Where a keyframe of those inserted should stand from now on; `applyPending` moves it.
  void move(std::size_t keyframe, const Rigid3& T_world_ref);
  /// Puts keyframes where they should stand whose points would otherwise be off by more than the
  /// tolerance, the oldest first, but no more than so many. Without tolerance all stand where they
  /// should, bit for bit.
  /// @throws std::invalid_argument as GlobalCloud::insert does: that keyframe stays where it was.
  void applyPending(double tolerance_m, std::size_t most = std::numeric_limits<std::size_t>::max());

  const GlobalCloud& cloud() const { return cloud_; }
  /// Where the keyframes stand in the cloud, but for those of an earlier map.
  const std::vector<Rigid3>& T_world_ref() const { return T_world_ref_; }

 private:
  void put(std::size_t keyframe, const Rigid3& T_world_ref);

  struct KeptPoints {
    std::vector<ViewPoint> points;
    double radius_m = 0;  // no point is farther from the view
  };

  GlobalCloud cloud_;
  bool movable_;
  std::size_t fixed_ = 0;
  std::vector<Rigid3> T_world_ref_;
  std::vector<KeptPoints> kept_;           // beside T_world_ref_ where they may move
  std::map<std::size_t, Rigid3> pending_;  // where keyframes should stand
};

}  // namespace efm
