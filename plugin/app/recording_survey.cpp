// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/app/recording_survey.h"

#include <exception>

#include "plugin/app/interruption.h"
#include "plugin/app/progress.h"
#include "plugin/mrpt/hosted_mapping.h"

namespace efm {

RecordingSurvey surveyRecording(const MappingJob& job, Recording& recording) {
  RecordingSurveyor surveyor(job.options);
  Progress progress("first look", job.verbosity);
  try {
    while (const auto observation = recording.next()) {
      if (job.stop_requested && job.stop_requested()) throw Interrupted();
      addTo(surveyor, *observation);
      progress.show(recording.progress());
    }
  } catch (const Interrupted&) {
    throw;
  } catch (const std::exception&) {
  }
  return surveyor.finish();
}

}  // namespace efm
