// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <functional>
#include <vector>

#include "mapping/keyframes/keyframe_depth_map.h"
#include "maps/cloud/global_cloud.h"
#include "maps/cloud/map_point.h"
#include "maps/refinement/keyframe_refiner.h"
#include "plugin/session/event_fusion_options.h"
#include "test/studies/recordings/recording_cache.h"
#include "tracking_stub/faults/tracker_faults.h"

namespace efm::studies {

/// A recording mapped with tracker errors and with refined poses.
struct PoseRefinementRun {
  std::vector<KeyframeDepthMap> keyframes;  ///< With the tracker's poses.
  std::vector<Rigid3> T_odom_ref;
  std::vector<Rigid3> T_world_ref;  ///< Refined, at the end.
  MapCloud::ConstPtr refined_map;   ///< Exported by the session.
  RefinementCounts counts;
};

/// Plays the recording into a MappingSession: events in packets of 50 ms, and the true poses at 200
/// Hz with the faults. Noise per keyframe begins at the first window.
/// @throws std::logic_error where the session's windows begin at another time.
PoseRefinementRun mapRefined(const Recording& recording, const EventFusionOptions& options,
                             TrackerFaults faults);

/// The map of keyframes at these poses.
MapCloud::ConstPtr mapAt(const std::vector<KeyframeDepthMap>& keyframes,
                         const std::vector<Rigid3>& T_world_ref, const GlobalCloudOptions& options);

/// The result of refining keyframes.
struct RefinerRun {
  std::vector<Rigid3> T_world_ref;  ///< At the end.
  /// Time of each keyframe: choice of points, registration and search for loops. Real time, and
  /// time of the processor, which does not depend on other load of the machine.
  std::vector<double> seconds;
  std::vector<double> processor_seconds;
  RefinementCounts counts;
};

/// Refines the keyframes again without a session.
/// @param after called with the number of each added keyframe. It may propose loops.
RefinerRun refineKeyframes(
    const std::vector<KeyframeDepthMap>& keyframes, const RefinementOptions& options,
    const std::function<void(KeyframeRefiner&, std::size_t)>& after = nullptr);

}  // namespace efm::studies
