// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <mrpt/maps/CSimpleMap.h>

#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "mapping/geometry/rigid3.h"
#include "maps/cloud/cloud_points.h"
#include "maps/cloud/keyframe_cloud.h"
#include "plugin/mrpt/mrpt_point_maps.h"

namespace efm {

/// The points of a keyframe in its reference view, and the pose of the view. 20 bytes a point.
/// Transformed to the world, they are the points of the map again, bit for bit.
struct StoredKeyframe {
  std::int64_t t_ref_ns = 0;
  Rigid3 T_world_ref;
  /// In frame `ref`, float, intensity = confidence. Never null; shared and never changed.
  mrpt::maps::CPointsMapXYZI::Ptr points;
  /// Standard deviation of depth of each point, metres; null where it is not known: a simplemap has
  /// no place for it.
  std::shared_ptr<const std::vector<float>> sigma = nullptr;
};

/// @param points the keyframe's points in the map.
StoredKeyframe storedKeyframe(const KeyframeDepthMap& keyframe,
                              const std::vector<ViewPoint>& points);

/// The points of a keyframe with a confidence. (MRPT's clouds may have points of intensity 0.)
std::vector<ViewPoint> viewPointsOf(const StoredKeyframe& keyframe);
/// p_world = T_world_ref * p_ref.
std::vector<CloudPoint> worldPointsOf(const StoredKeyframe& keyframe);

/// A keyframe from an observation of a point cloud with intensities.
/// @return nothing for other observations.
std::optional<StoredKeyframe> keyframeFrom(const mrpt::obs::CObservation& observation,
                                           const Rigid3& T_world_rig);

/// Adds the keyframe to a simplemap in MRPT's own classes, for any MRPT program: the view's pose in
/// the world without covariance, and a frame with one CObservationPointCloud. Its label is
/// "keyframe", its time t_ref (rounded to MRPT's tick), its sensor pose the identity.
void insertInto(mrpt::maps::CSimpleMap& map, const StoredKeyframe& keyframe);
/// The keyframes of a simplemap. A frame may have several.
/// @throws std::invalid_argument naming the first frame without a keyframe.
std::vector<StoredKeyframe> keyframesOf(const mrpt::maps::CSimpleMap& map);

}  // namespace efm
