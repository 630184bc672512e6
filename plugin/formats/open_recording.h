// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "plugin/recordings/recording.h"
#include "tracking_stub/faults/tracker_faults.h"

namespace efm {

/// A recording, and files that replace its poses, calibration or hand-eye transform. The recording
/// needs none of its own then.
struct RecordingSource {
  std::vector<std::filesystem::path> files;  ///< One file or folder.
  std::string format = "auto";               ///< One of `recordingFormats`. "auto": detected.
  std::filesystem::path poses;               ///< TUM, T_world_body. Empty: the recording's.
  std::filesystem::path calibration;         ///< See `readCalibration`. Empty: the recording's.
  std::filesystem::path hand_eye;            ///< See `readHandEye`. Empty: the recording's.
  TrackerFaults faults;                      ///< Of the poses (CObservationRobotPose).
  /// Calibration and hand-eye transform replace those of the observations. Otherwise they are used
  /// only if the recording has none, and a map builder's options replace the others.
  bool override_rig = true;
};

/// The names of all formats, "auto" first.
std::vector<std::string> recordingFormats();

/// Opens a recording: a rawlog, a dataset folder (camchain.yaml, camN/events.txt, poses.txt) or a
/// folder in the UZH text layout (events.txt, groundtruth.txt, calib.txt).
/// @throws std::runtime_error naming the missing or wrong file and the expected ones;
/// std::invalid_argument if the calibration is of other cameras or the faults are not valid.
std::unique_ptr<Recording> openRecording(const RecordingSource& source);

}  // namespace efm
