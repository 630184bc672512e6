// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <vector>

#include "mapping/geometry/rig.h"
#include "mapping/keyframes/fusion_mapper.h"
#include "mapping/survey/option_choice.h"
#include "plugin/session/map_refinement.h"
#include "plugin/session/pose_source_selector.h"
#include "plugin/session/stage_timer.h"

namespace efm {

/// First and last time of a stream, on the trajectory's clock.
struct TimeSpan {
  std::int64_t first_ns = 0;
  std::int64_t last_ns = 0;
};

/// The input of a session and its work so far.
struct SessionStatus {
  MapperCounts counts;  ///< Complete after `finish`.
  StageTimes times;     ///< Of the stages within the session; the caller fills in the rest.
  std::optional<TimeSpan> events;
  std::optional<TimeSpan> poses;
  std::optional<PoseSourceId> pose_source;            ///< The source whose poses are used.
  std::map<PoseSourceId, std::uint64_t> other_poses;  ///< Poses of other sources: not used.
  std::vector<std::uint64_t> silent_keyframes;        ///< Per camera: keyframes without its events.
  Rig rig;                                    ///< The cameras so far, with the options' overrides.
  std::size_t recalibrated_cameras = 0;       ///< Cameras whose recorded calibration differs.
  std::vector<ChosenOption> chosen;           ///< Automatic options.
  std::optional<RefinementState> refinement;  ///< Where poses are refined.
};

}  // namespace efm
