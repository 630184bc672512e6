// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <mrpt/obs/CObservation.h>

#include <optional>
#include <vector>

#include "mapping/survey/window_sample.h"
#include "plugin/app/mapping_run.h"
#include "plugin/recordings/recording.h"
#include "plugin/session/mapping_session.h"

namespace efm {

/// What a first pass over a recording found: its cameras and some of its windows, evenly spread.
struct RecordingSurvey {
  Rig rig;
  std::vector<WindowSample> samples;
  /// The time from the first to the last event with a pose; nothing without such events.
  std::optional<double> duration_s;

  /// Whether the poses explain the events. An error is left to the pass that maps.
  std::vector<Warning> poseWarnings(const FusionMapperOptions& options) const;
};

/// Surveys a recording in one pass. Memory does not grow with its length: of more than a million
/// events per second and camera, some are chosen evenly.
class RecordingSurveyor {
 public:
  /// @throws std::runtime_error naming a file of the options that cannot be read.
  explicit RecordingSurveyor(const EventFusionOptions& options);

  /// @throws std::exception where a MappingSession does; then nothing more may be added.
  void add(const mrpt::obs::CObservation& observation);
  /// Once: after the last observation, or after an error.
  RecordingSurvey finish();

 private:
  void takeWindows();

  MappingSession session_;
  SpreadSamples samples_;
};

/// Reads a recording once. An error of the recording ends it: the pass that maps reports the error.
/// @param job whose receivers are not called.
/// @throws std::runtime_error naming a file of the options that cannot be read; Interrupted if a
/// stop was requested.
RecordingSurvey surveyRecording(const MappingJob& job, Recording& recording);

}  // namespace efm
