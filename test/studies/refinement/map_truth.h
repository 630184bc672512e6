// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <map>
#include <opencv2/core.hpp>
#include <vector>

#include "mapping/keyframes/keyframe_depth_map.h"
#include "maps/cloud/map_point.h"
#include "test/studies/refinement/wall_thickness.h"
#include "tracking_stub/sensor/simulated_rig.h"

namespace efm::studies {

/// Errors of the poses of keyframes and of their map. Before all but the end-to-end errors are
/// computed, the estimate is aligned with the truth: a rigid motion, least squares of the
/// positions.
struct MapErrors {
  double trajectory_m = 0;  ///< Root mean square.
  double trajectory_rad = 0;
  double map_m = 0;   ///< Median distance of the map's points to the nearest surface.
  double rays_m = 0;  ///< Median distance of a keyframe's points to the true ends of their rays.
  /// Of the relative pose of the first and the last keyframe, without alignment.
  double end_to_end_m = 0;
  double end_to_end_rad = 0;
  double thickness_m = 0;  ///< Of the walls.
};

/// The exact truth of a simulation, for its maps.
class MapTruth {
 public:
  explicit MapTruth(const Simulation& simulation);

  /// @param keyframes their depth maps count, their poses do not.
  /// @param T_map_ref estimated poses of the keyframes.
  /// @param cloud of the map with these poses.
  /// @throws std::invalid_argument where there are fewer than three keyframes.
  MapErrors errorsOf(const std::vector<KeyframeDepthMap>& keyframes,
                     const std::vector<Rigid3>& T_map_ref, const MapCloud& cloud);

  Rigid3 T_world_ref(const KeyframeDepthMap& keyframe) const;
  const std::vector<Wall>& walls() const { return walls_; }

 private:
  const cv::Mat1f& depthOf(const KeyframeDepthMap& keyframe);
  double medianOffRays(const std::vector<KeyframeDepthMap>& keyframes,
                       const std::vector<Rigid3>& T_world_estimate);

  const Simulation& simulation_;
  std::vector<Wall> walls_;
  std::map<std::int64_t, cv::Mat1f> depths_;  // by the keyframe's time: rendered once
};

}  // namespace efm::studies
