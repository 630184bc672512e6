// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <stdexcept>

#include "test/studies/recordings/study_run.h"
#include "tracking_stub/sensor/simulated_rig.h"

namespace efm::studies {

/// The folder of real calibrations and trajectories lacks a file.
class MissingData : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// MVSEC's two DAVIS346 on the smoothed trajectory of indoor_flying1, from where it gets under way,
/// through a furnished room.
/// @throws MissingData naming the file that is not there.
Simulation mvsecInRoom(const StudyRun& run, double duration_s);

/// The recording of it that most studies share: 10 s, or a moment where the run is quick.
Recording roomRecording(const StudyRun& run);

/// DSEC's two Prophesee Gen3 on the smoothed trajectory of zurich_city_04, through a street.
/// @throws MissingData naming the file that is not there.
Simulation dsecInStreet(const StudyRun& run, double duration_s);

}  // namespace efm::studies
