// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "mapping/geometry/reference_view.h"
#include "mapping/keyframes/fusion_mapper.h"
#include "plugin/options/option_file.h"
#include "plugin/session/map_refinement.h"
#include "plugin/session/stage_timer.h"
#include "tracking_stub/faults/tracker_faults.h"

namespace efm {

/// What a run read, did and took: the content of report.json.
struct MapReport {
  MapperCounts counts;
  std::vector<std::uint64_t> silent_keyframes;  ///< Per camera: those that it had no event for.
  std::uint64_t points = 0;                     ///< Of the exported map.
  StageSeconds seconds;
  EventFusionOptions options;                 ///< As used.
  TrackerFaults faults;                       ///< That the poses were given.
  std::optional<RefinementState> refinement;  ///< Where poses were refined.
  /// What `max_confidence = sequence` stood for, where a pass of its own found it.
  std::optional<double> sequence_maximum;
  /// The view of the depth maps, and how far its camera is from the nearest other that took part:
  /// what turns depth into disparity. Not given where the rig was never complete or has one camera.
  std::optional<ReferenceView> view;
  std::optional<double> baseline_m;
};

/// The report as indented JSON: events (total and per camera; read = used + without_pose +
/// outside_window + dropped + filtered), event_uses, votes (event_uses x planes = their sum),
/// keyframes, silent (keyframes per camera, sub-intervals), points, seconds, votes_per_second,
/// refinement where there was one (keyframes registered, loops, the tracker's errors as learnt),
/// kernel, threads, peak_memory_bytes (of this process), reference_view and baseline_m where known,
/// perturbation (the faults that the poses were given, where there are any), options (all of them)
/// and version.
std::string reportJson(const MapReport& report);

/// Votes (used events times planes) over the sweep's seconds; 0 where nothing was swept.
double votesPerSecond(const MapReport& report);

}  // namespace efm
