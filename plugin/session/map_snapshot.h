// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "mapping/geometry/rigid3.h"
#include "mapping/geometry/trajectory.h"
#include "maps/cloud/cloud_points.h"
#include "maps/cloud/map_point.h"

namespace efm {

/// Points of a keyframe in its reference view, and the pose of the view. 20 bytes per point.
/// Transformed to the world, they are again the points of the map, bit for bit.
struct StoredKeyframe {
  std::int64_t t_ref_ns = 0;
  Rigid3 T_world_ref;
  std::shared_ptr<const std::vector<ViewPoint>> points;  ///< Never null; shared, never changed.
};

/// The map at one moment.
struct MapSnapshot {
  /// T_world_ref of all keyframes at t_ref. The keyframes of the initial map come first.
  std::vector<StampedPose> trajectory;
  /// The poses of the same keyframes by the tracker. They differ if keyframes are refined.
  std::vector<StampedPose> tracker_trajectory;
  std::vector<StoredKeyframe> keyframes;  ///< All in playback, the newest in live operation.
  MapCloud::ConstPtr points;              ///< The exported points.
};

}  // namespace efm
