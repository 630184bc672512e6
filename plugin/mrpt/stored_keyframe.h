// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <mrpt/maps/CPointsMapXYZI.h>
#include <mrpt/maps/CSimpleMap.h>
#include <mrpt/obs/CObservationPointCloud.h>

#include <cstdint>
#include <optional>
#include <vector>

#include "mapping/geometry/rigid3.h"
#include "maps/cloud/cloud_point.h"
#include "maps/cloud/keyframe_cloud.h"

namespace efm {

/// What stays of a keyframe: its points as its reference view sees them, float, and where the view
/// stood. 16 bytes a point. Put into the world it gives the points of the map again, bit for bit.
struct StoredKeyframe {
  std::int64_t t_ref_ns = 0;
  Rigid3 T_world_ref;
  /// Frame `ref`, intensity = confidence; never null, shared by whoever shows it, never changed.
  mrpt::maps::CPointsMapXYZI::Ptr points;
};

/// @param points the keyframe's, as they went into the map.
StoredKeyframe storedKeyframe(const KeyframeDepthMap& keyframe,
                              const std::vector<ViewPoint>& points);

/// The points of a cloud that weigh something. MRPT's clouds may hold points of intensity 0.
std::vector<ViewPoint> viewPointsOf(const mrpt::maps::CPointsMapXYZI& cloud);
/// p_world = T_world_ref * p_ref.
std::vector<CloudPoint> worldPointsOf(const StoredKeyframe& keyframe);

/// A cloud of MRPT's own with positions and intensities, seen from the robot at a pose.
/// @return nothing where it is no such observation.
std::optional<StoredKeyframe> keyframeFrom(const mrpt::obs::CObservation& observation,
                                           const Rigid3& T_world_rig);

/// Adds the keyframe to a simplemap as classes of MRPT's own, so that any MRPT program reads it:
/// the view's pose in the world without covariance, and a frame with one CObservationPointCloud,
/// labelled "keyframe", at t_ref (rounded to MRPT's tick), whose sensor stands at that pose.
void insertInto(mrpt::maps::CSimpleMap& map, const StoredKeyframe& keyframe);
/// The keyframes of a simplemap: a frame may hold several.
/// @throws std::invalid_argument naming the first frame without any.
std::vector<StoredKeyframe> keyframesOf(const mrpt::maps::CSimpleMap& map);

}  // namespace efm
