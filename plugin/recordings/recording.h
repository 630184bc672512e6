// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <mrpt/obs/CObservation.h>

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "tracking_stub/faults/tracker_faults.h"

namespace efm {

/// What was odd about a recording, though it could be read.
struct RecordingCounts {
  std::uint64_t sorted_events = 0;         ///< Came later than a newer one, by up to 10 ms.
  std::uint64_t recalibrated_cameras = 0;  ///< Whose calibration differs from the one given for it.
};

/// A recording as a stream of observations in the order of time: CObservationEvents and
/// CObservationRobotPose, and whatever else a rawlog holds. A pose comes before the packets that
/// begin at its time or later. Memory does not grow with the length of the recording.
class Recording {
 public:
  virtual ~Recording() = default;

  /// @return nothing at the end.
  /// @throws std::runtime_error naming file and place where it cannot be read on.
  virtual mrpt::obs::CObservation::Ptr next() = 0;

  /// Where the observation that `next` gave last stands, for messages: "entry 12 of my.rawlog".
  virtual std::string place() const = 0;

  /// The share of the input that was read, 0 to 1.
  virtual double progress() const = 0;

  virtual RecordingCounts counts() const { return {}; }
};

/// Where a recording is, and what is given in place of what it holds itself: then a recording need
/// not hold it at all.
struct RecordingSource {
  std::vector<std::filesystem::path> files;  ///< What the format needs; each of these takes one.
  std::string format = "auto";               ///< One of `recordingFormats`; "auto" looks at it.
  std::filesystem::path poses;               ///< TUM, T_world_body; empty: the recording's.
  std::filesystem::path calibration;         ///< As `readCalibration` takes it; empty: as recorded.
  std::filesystem::path hand_eye;            ///< As `readHandEye` takes it; empty: as recorded.
  TrackerFaults faults;                      ///< Of its CObservationRobotPose; none by default.
};

/// The formats that `openRecording` knows, "auto" first.
std::vector<std::string> recordingFormats();

/// Opens a recording: a rawlog, a dataset folder (camchain.yaml, camN/events.txt, poses.txt) or a
/// folder in the UZH text layout (events.txt, groundtruth.txt, calib.txt).
/// @throws std::runtime_error naming what is missing or not understood, and what was looked for;
/// std::invalid_argument where the calibration is of other cameras or the faults are not valid.
std::unique_ptr<Recording> openRecording(const RecordingSource& source);

}  // namespace efm
