// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <set>
#include <string>

#include "plugin/mrpt/CObservationEvents.h"
#include "plugin/recordings/recording.h"
#include "plugin/session/rig_setup.h"

namespace efm {

/// A recording whose packets carry another calibration and whose poses say otherwise where the rig
/// is on the tracked body.
class RigOverrideRecording : public Recording {
 public:
  RigOverrideRecording(std::unique_ptr<Recording> recording, RigSetup setup);

  /// @throws std::invalid_argument where the calibration has no such camera or one of another size,
  /// or at the end where it has cameras that the recording does not have.
  mrpt::obs::CObservation::Ptr next() override;
  std::string place() const override { return recording_->place(); }
  double progress() const override { return recording_->progress(); }
  RecordingCounts counts() const override;

 private:
  void recalibrate(CObservationEvents& packet);

  std::unique_ptr<Recording> recording_;
  RigSetup setup_;
  std::set<int> cameras_;       // that were seen
  std::set<int> recalibrated_;  // of them: whose own calibration is another
};

}  // namespace efm
