// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <set>
#include <string>

#include "plugin/mrpt/CObservationEvents.h"
#include "plugin/recordings/recording.h"
#include "plugin/session/rig_setup.h"

namespace efm {

/// A recording with another calibration in its packets, and another hand-eye transform in its
/// poses. For who writes or shows observations. A map builder has its own options for both.
class RigOverrideRecording : public Recording {
 public:
  RigOverrideRecording(std::unique_ptr<Recording> recording, RigSetup setup);

  /// @throws std::invalid_argument where the calibration has no such camera or one of another size,
  /// or at the end where it has cameras that the recording does not have.
  mrpt::obs::CObservation::Ptr next() override;
  std::string place() const override { return recording_->place(); }
  double progress() const override { return recording_->progress(); }
  RecordingCounts counts() const override { return recording_->counts(); }

 private:
  std::unique_ptr<Recording> recording_;
  RigSetup setup_;
  std::set<int> cameras_;  // seen so far
};

}  // namespace efm
