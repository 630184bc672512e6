// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <functional>
#include <vector>

#include "mapping/keyframes/keyframe_depth_map.h"
#include "maps/cloud/cloud_point.h"
#include "maps/cloud/global_cloud.h"
#include "maps/refinement/keyframe_refiner.h"
#include "plugin/session/event_fusion_options.h"
#include "test/studies/recordings/recording_cache.h"
#include "tracking_stub/faults/tracker_faults.h"

namespace efm::studies {

/// A recording mapped with a tracker that errs, its poses refined.
struct PoseRefinementRun {
  std::vector<KeyframeDepthMap> keyframes;  ///< Where the tracker put them.
  std::vector<Rigid3> T_odom_ref;
  std::vector<Rigid3> T_world_ref;      ///< Refined, once nothing more came.
  std::vector<CloudPoint> refined_map;  ///< As the session exports it.
  RefinementCounts counts;
};

/// Plays the recording into a MappingSession as it would come in: events in packets of 50 ms, and
/// the true poses at 200 Hz with the faults. Noise per keyframe begins where the first window does.
/// @throws std::logic_error where the session's windows begin elsewhere.
PoseRefinementRun mapRefined(const Recording& recording, const EventFusionOptions& options,
                             TrackerFaults faults);

/// The map of keyframes at these poses.
std::vector<CloudPoint> mapAt(const std::vector<KeyframeDepthMap>& keyframes,
                              const std::vector<Rigid3>& T_world_ref,
                              const GlobalCloudOptions& options);

/// What a refiner made of keyframes.
struct RefinerRun {
  std::vector<Rigid3> T_world_ref;  ///< Once nothing more came.
  /// Of each keyframe: its points chosen, added, loops looked for; real time, and that of the
  /// processor, which others that use the machine do not add to.
  std::vector<double> seconds;
  std::vector<double> processor_seconds;
  RefinementCounts counts;
};

/// Refines the keyframes once more, alone.
/// @param after called with each keyframe's number once it is added; may propose loops.
RefinerRun refineKeyframes(
    const std::vector<KeyframeDepthMap>& keyframes, const RefinementOptions& options,
    const std::function<void(KeyframeRefiner&, std::size_t)>& after = nullptr);

}  // namespace efm::studies
