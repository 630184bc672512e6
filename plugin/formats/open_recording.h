// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "plugin/recordings/recording.h"
#include "tracking_stub/faults/tracker_faults.h"

namespace efm {

/// Where a recording is, and what is given in place of what it holds itself: then a recording need
/// not hold it at all.
struct RecordingSource {
  std::vector<std::filesystem::path> files;  ///< What the format needs; each of these takes one.
  std::string format = "auto";               ///< One of `recordingFormats`; "auto" looks at it.
  std::filesystem::path poses;               ///< TUM, T_world_body; empty: the recording's.
  std::filesystem::path calibration;         ///< As `readCalibration` takes it; empty: as recorded.
  std::filesystem::path hand_eye;            ///< As `readHandEye` takes it; empty: as recorded.
  TrackerFaults faults;                      ///< Of its CObservationRobotPose; none by default.
  bool override_rig =
      true;  ///< Calibration and hand-eye go into the observations. Otherwise they only
             ///< stand in for missing ones: a map builder's options replace them.
};

/// The formats that `openRecording` knows, "auto" first.
std::vector<std::string> recordingFormats();

/// Opens a recording: a rawlog, a dataset folder (camchain.yaml, camN/events.txt, poses.txt) or a
/// folder in the UZH text layout (events.txt, groundtruth.txt, calib.txt).
/// @throws std::runtime_error naming what is missing or not understood, and what was looked for;
/// std::invalid_argument where the calibration is of other cameras or the faults are not valid.
std::unique_ptr<Recording> openRecording(const RecordingSource& source);

}  // namespace efm
