// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <set>
#include <string>

#include "plugin/mrpt/CObservationEvents.h"
#include "plugin/recordings/open/recording.h"
#include "plugin/session/event_fusion_options.h"

namespace efm {

/// A recording with another calibration in its packets and another hand-eye transform in its poses.
/// For commands that write or show observations; a map builder has options for both.
class RigOverrideRecording : public Recording {
 public:
  RigOverrideRecording(std::unique_ptr<Recording> recording, RigSetup setup);

  /// @throws std::invalid_argument where the calibration lacks a camera or has another size of it;
  /// at the end where it has more cameras than the recording.
  mrpt::obs::CObservation::Ptr next() override;
  std::string position() const override { return recording_->position(); }
  double progress() const override { return recording_->progress(); }
  RecordingCounts counts() const override { return recording_->counts(); }

 private:
  std::unique_ptr<Recording> recording_;
  RigSetup setup_;
  std::set<int> cameras_;  // seen so far
};

}  // namespace efm
