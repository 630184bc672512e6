// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "plugin/app/mapping_run.h"
#include "plugin/recordings/open/merged_recording.h"
#include "plugin/session/recording_survey.h"

namespace efm {

/// Reads a recording once. An error of the recording ends it: the pass that maps reports the error.
/// @param job whose receivers are not called.
/// @throws std::runtime_error naming a file of the options that cannot be read; Interrupted if a
/// stop was requested.
RecordingSurvey surveyRecording(const MappingJob& job, Recording& recording);

}  // namespace efm
