// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "mapping/geometry/trajectory.h"
#include "plugin/recordings/calibration/calibration_file.h"
#include "plugin/recordings/streams/event_stream.h"

namespace efm {

/// A depth map of the truth.
struct TruthDepth {
  std::int64_t t_ns = 0;
  std::filesystem::path file;  ///< float32 TIFF: z-depth in metres in camera 0's undistorted view.
};

/// What a reader finds in the files of a recording. All parts may be missing: other sources, or
/// files of their own, may have them.
struct RecordingParts {
  std::vector<std::unique_ptr<EventStream>> cameras;
  /// The recording's own calibration, of all cameras.
  std::optional<Calibration> calibration;
  /// The sensors' size where neither the stream nor a calibration knows it.
  std::optional<CameraSize> default_size;

  std::vector<StampedPose> poses;  ///< T_world_body, in any order.
  /// The error of the damage behind `poses`; empty: they are all.
  std::string poses_damage;

  std::vector<Warning> warnings;  ///< Which files were taken for the parts.

  /// What the format calls its missing parts, for errors: "calib.txt".
  std::string expected_calibration = "a calibration in the recording";
  std::string expected_poses = "poses in the recording";
};

/// Choices that a reader cannot find in the file.
struct ReaderOptions {
  /// Topics of bags, or names of streams, to read: events (one per camera, in the order of the
  /// cameras) and poses. Empty: found by their type.
  std::vector<std::string> topics;
  /// The columns of text events and arrays, e.g. "x y p t", `-` for one to ignore. Empty: those of
  /// the header, else t x y p. Or the names of arrays, fields or data sets: "t=a x=b y=c p=d".
  std::string columns;
  /// The unit of times in text events and NumPy arrays, and of real times in HDF5: s, ms, us or ns.
  /// Empty: found, else s.
  std::string time_unit;
  /// The pixels of all sensors, where neither the recording nor a calibration has them.
  std::optional<CameraSize> sensor_size{};
  /// Whether `topics` may have names of other files. Otherwise an unknown name is an error.
  bool topics_of_other_files = false;
};

/// A family of formats. A new one is a row of the table in recording_formats.cpp.
struct RecordingFormat {
  std::string name;         ///< Of `--format`.
  std::string description;  ///< For errors.
  /// Whether a file or folder has this format, by its content. Never throws.
  bool (*matches)(const std::filesystem::path&);
  /// Opens the files of one recording, at least one. Cameras are in the order of the files.
  /// @throws std::runtime_error naming the file and what was expected.
  RecordingParts (*open)(const std::vector<std::filesystem::path>& files, const ReaderOptions&);
  /// The depth maps of a source's truth, in the order of its list; null where the format has none.
  /// @throws std::runtime_error naming the file and the line that is wrong.
  std::vector<TruthDepth> (*truth)(const std::filesystem::path& source) = nullptr;
};

}  // namespace efm
