// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "plugin/recordings/recording.h"
#include "tracking_stub/faults/tracker_faults.h"

namespace efm {

/// The files of a recording, and replacements for its parts. A recording may lack a part that has a
/// replacement.
struct RecordingSource {
  std::vector<std::filesystem::path> files;  ///< One path: a file or a folder, by the format.
  std::string format = "auto";               ///< One of `recordingFormats`; "auto" detects it.
  std::filesystem::path poses;               ///< TUM, T_world_body; empty: the recording's.
  std::filesystem::path calibration;         ///< As `readCalibration` takes it; empty: as recorded.
  std::filesystem::path hand_eye;            ///< As `readHandEye` takes it; empty: as recorded.
  TrackerFaults faults;                      ///< Of its CObservationRobotPose; none by default.
  bool override_rig =
      true;  ///< Write calibration and hand-eye into the observations. False: use them only
             ///< where they are missing, because the map builder's options replace them.
};

/// The formats that `openRecording` knows, "auto" first.
std::vector<std::string> recordingFormats();

/// Opens a recording: a rawlog, a dataset folder (camchain.yaml, camN/events.txt, poses.txt) or a
/// folder in the UZH text layout (events.txt, groundtruth.txt, calib.txt).
/// @throws std::runtime_error naming the missing or wrong file, and what was expected;
/// std::invalid_argument if the calibration is of other cameras or the faults are not valid.
std::unique_ptr<Recording> openRecording(const RecordingSource& source);

}  // namespace efm
