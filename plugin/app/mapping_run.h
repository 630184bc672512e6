// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <mrpt/maps/CSimpleMap.h>

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "mapping/keyframes/keyframe_mapper.h"
#include "maps/cloud/cloud_point.h"
#include "plugin/options/option_file.h"
#include "plugin/output/report.h"
#include "plugin/recordings/recording.h"

namespace efm {

/// How to map a recording, and who receives what is made on the way.
struct MappingJob {
  EventFusionOptions options;
  /// What `max_confidence = sequence` stands for; the running maximum where not given.
  std::optional<double> sequence_maximum;

  /// Receives each keyframe, in order.
  std::function<void(const KeyframeDepthMap&)> take_keyframe;
  /// Asked once, when the reference camera is known, for a receiver of the DSI's planes. May be
  /// empty.
  std::function<DsiSink*(const ReferenceView&)> make_dsi_sink;
};

/// What a run made.
struct MappingOutcome {
  MapReport report;  ///< Without the total of seconds.
  std::vector<CloudPoint> points;
  mrpt::maps::CSimpleMap keyframes;  ///< Their clouds and poses.
  /// T_world_ref of the keyframes at t_ref: in the map, and by the tracker.
  std::vector<StampedPose> trajectory;
  std::vector<StampedPose> tracker_trajectory;
  std::size_t recalibrated_cameras = 0;  ///< Their recorded calibrations differ from the options'.
  /// What was odd about the input, though it was mapped: one line each.
  std::vector<std::string> warnings;
  /// Why the recording was not read to its end or gave no keyframe.
  std::optional<std::string> error;
};

/// Plays a recording through a map builder, with progress on stderr where that is a terminal. Where
/// reading stops with an error, what came before is mapped to its end.
/// @throws std::invalid_argument where the options are not valid; what `take_keyframe` and
/// `make_dsi_sink` throw.
MappingOutcome runMapping(const MappingJob& job, Recording& recording);

/// The first of two passes: plays a recording for the robust maximum of its keyframes' confidences
/// alone. Costs as much as mapping it. Nothing where there is no keyframe; what is wrong with the
/// recording is left for `runMapping` to say.
/// @throws std::invalid_argument where the options are not valid.
std::optional<double> sequenceMaximum(const EventFusionOptions& options, Recording& recording);

}  // namespace efm
