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
#include "plugin/session/event_fusion_options.h"
#include "plugin/session/sample.h"
#include "tracking_stub/faults/tracker_faults.h"

namespace efm {

/// A recording, and files that replace its poses, calibration or hand-eye transform. The recording
/// needs none of its own then.
struct RecordingSource {
  std::vector<std::filesystem::path> files;  ///< Files and folders of one recording.
  std::string format = "auto";               ///< One of `recordingFormats`. "auto": detected.
  std::filesystem::path poses;               ///< See `readPoses`. Empty: the recording's.
  std::filesystem::path calibration;         ///< See `readCalibration`. Empty: the recording's.
  std::filesystem::path hand_eye;            ///< See `readHandEye`. Empty: the recording's.
  /// Where and how these two were given, for errors. Empty: as --calibration and --hand-eye.
  std::string calibration_given;
  std::string hand_eye_given;
  /// The content of these two, if it was read already.
  std::shared_ptr<const RigSetup> setup = nullptr;
  TrackerFaults faults;  ///< Of the poses of trackers (PoseKind::kPose).
  /// Calibration and hand-eye transform replace those of the samples. Otherwise they are used
  /// only if the recording has none, and a mapping's options replace the others.
  bool override_rig = true;
  /// Poses of trackers and cameras as `roundedPose` has them. A writer of rawlogs rounds itself.
  bool rounded = true;

  ReaderOptions reader;
  /// The number of bad events of the whole recording that are left out. One more is an error.
  std::uint64_t skip_bad_events = 0;
  std::int64_t packet_ns = kPacketPeriodNs;  ///< Length of the packets of events, above 0.
  TimeLimits limits;                         ///< See `join`.
  /// Time offsets of the cameras, in place of the calibration's where `limits` cut; empty: none.
  std::vector<std::int64_t> time_offsets_ns;
  /// Whether missing poses, or a missing calibration, are an error. Cameras without a calibration
  /// have a model without a focal length.
  bool complete = true;
};

/// Reads calibration and hand-eye transform.
/// @throws std::runtime_error naming how a missing file was given.
RigSetup readRigSetup(const RecordingSource& source);

/// The names of all formats, "auto" first.
std::vector<std::string> recordingFormats();

/// Opens a recording: the files and folders of `readerFormats`, whose cameras and poses are put
/// together in the order of the files, or a rawlog.
std::unique_ptr<Recording> openRecording(const RecordingSource& source);

/// The depth maps of the recording's truth, if it has any that is read: that of the formats with
/// `RecordingFormat::truth`. Opens no events.
std::vector<TruthDepth> openTruth(const RecordingSource& source);

}  // namespace efm
