// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <vector>

#include "mapping/base/text.h"
#include "mapping/survey/option_choice.h"
#include "mapping/survey/scene_depths.h"
#include "plugin/session/event_fusion_options.h"
#include "plugin/session/map_quality.h"

namespace efm {

/// Result of a first look at the poses.
struct PoseVerdict {
  std::vector<Warning> warnings;
  std::vector<Warning> notes;  ///< What could not be checked.
  QualityFacts quality;
  /// True if the calibration between cameras is wrong. A correction of the motion would then hide
  /// it, and make the map worse.
  bool keep_motion = false;
};

/// Returns the events per second of all cameras together.
double eventRate(const WindowData& data);

/// Result of a first look at a recording: its cameras and some of its windows, evenly spread.
struct RecordingSurvey {
  Rig rig;
  std::vector<WindowSample> samples;
  /// Time from the first to the last event with a pose; std::nullopt if there is none.
  std::optional<double> duration_s;
  /// Highest event rate of a window, all cameras together.
  double most_events_per_s = 0;
  double lever_m = 0;  ///< Longest lever arm from the tracked body to the rig.
  std::vector<UndistortionTable> undistortion;  ///< All sweeps of the samples share them.
};

/// What is chosen for a recording, or for the beginning of a stream.
struct Chosen {
  FusionMapperOptions mapper;  ///< With the chosen values.
  OptionChoice choice;
  PoseVerdict verdict;  ///< About the poses, with these options.
};

/// Chooses the automatic options. The poses are not judged.
Chosen choose(const RecordingSurvey& survey, const EventFusionOptions& options);

}  // namespace efm
