// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <stdexcept>

#include "test/studies/recordings/study_run.h"
#include "tracking_stub/sensor/simulated_rig.h"

namespace efm::studies {

/// A file of the real calibrations and trajectories is missing.
class MissingData : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// MVSEC's two DAVIS346 on the smoothed trajectory of indoor_flying1, from its start of motion,
/// through a furnished room.
/// @throws MissingData naming the missing file.
Simulation mvsecInRoom(const StudyRun& run, double duration_s);

/// Its recording for most studies: 10 s, or 0.2 s in a quick run.
Recording roomRecording(const StudyRun& run);

/// DSEC's two Prophesee Gen3 on the smoothed trajectory of zurich_city_04, through a street.
/// @throws MissingData naming the missing file.
Simulation dsecInStreet(const StudyRun& run, double duration_s);

}  // namespace efm::studies
