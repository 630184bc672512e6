// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "mapping/events/window.h"
#include "plugin/recordings/streams/event_packets.h"
#include "plugin/recordings/streams/recording_parts.h"
#include "plugin/recordings/streams/sample.h"
#include "tracking_stub/faults/tracker_faults.h"

namespace efm {

/// A recording, and files that replace its poses, calibration or hand-eye transform. If such a file
/// is given, the recording need not have the part.
struct RecordingSource {
  std::vector<std::filesystem::path> files;  ///< Files and folders of one recording.
  std::string format = "auto";               ///< One of `recordingFormats`. "auto": detected.
  std::filesystem::path poses;               ///< See `readPoses`. Empty: the recording's.
  std::filesystem::path calibration;         ///< See `readCalibration`. Empty: the recording's.
  std::filesystem::path hand_eye;            ///< See `readHandEye`. Empty: the recording's.
  /// Calibration and hand-eye transform, if they were read already.
  std::shared_ptr<const RigSetup> setup = nullptr;
  /// The cameras of the given calibration that the recording has, if it has fewer. Empty: all.
  std::vector<int> cameras;
  TrackerFaults faults;  ///< Faults of the poses of trackers (PoseKind::kPose).
  ReaderOptions reader;
  /// The maximum number of bad events that are left out of the recording. One more is an error.
  std::uint64_t skip_bad_events = 0;
  std::int64_t packet_ns = kPacketPeriodNs;  ///< Length of the packets of events, above 0.
  TimeLimits limits;                         ///< See `join`.
  /// Time offsets of the cameras that replace those of the calibration; empty: none.
  std::vector<std::int64_t> time_offsets_ns;
  /// True if missing poses, or a missing calibration, are an error. Cameras without a calibration
  /// have a model without a focal length.
  bool complete = true;
  bool only_poses = false;  ///< True if the events are not read.
};

/// Reads calibration and hand-eye transform.
/// @throws std::runtime_error naming how a missing file was given.
RigSetup readRigSetup(const RecordingSource& source);

/// Returns the names of all formats, "auto" first.
std::vector<std::string> recordingFormats();

/// Opens a recording: a rawlog, or files and folders of `readerFormats`, whose cameras and poses
/// are put together in the order of the files. Applies the given calibration, hand-eye transform
/// and time offsets: nothing changes the rig afterwards.
std::unique_ptr<Recording> openRecording(const RecordingSource& source);

/// Returns the depth maps of the recording's truth, for formats with `RecordingFormat::truth`.
/// Opens no events.
std::vector<TimedFile> openTruth(const RecordingSource& source);

}  // namespace efm
