// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <vector>

#include "mapping/survey/window_sample.h"
#include "plugin/app/mapping_run.h"
#include "plugin/recordings/recording.h"

namespace efm {

/// The first pass over a recording: its cameras and some of its windows, evenly spread.
struct RecordingSurvey {
  Rig rig;
  std::vector<WindowSample> samples;
  /// The time from the first to the last event with a pose; nothing without such events.
  std::optional<double> duration_s;
};

/// Reads a recording once. An error of the recording ends it: the pass that maps reports the error.
/// Memory does not grow with its length: of more than a million events per second and camera, some
/// are chosen evenly.
/// @param job whose receivers are not called.
/// @throws std::runtime_error naming a file of the options that cannot be read; Interrupted if a
/// stop was requested.
RecordingSurvey surveyRecording(const MappingJob& job, Recording& recording);

}  // namespace efm
