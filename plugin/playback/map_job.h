// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "plugin/playback/error_text.h"
#include "plugin/playback/planned_map.h"
#include "plugin/playback/progress.h"
#include "plugin/playback/recording_keyframes.h"
#include "plugin/recordings/open/open_recording.h"
#include "plugin/results/output/report.h"
#include "plugin/session/event_fusion_options.h"
#include "plugin/session_file/session_file.h"

namespace efm {

/// A recording to map.
struct MapJob {
  /// The recording. The options' calibration and hand-eye transform replace its own.
  RecordingSource source;
  EventFusionOptions options;   ///< See `prepare`.
  std::filesystem::path out;    ///< The folder of the result. Empty: no file is written.
  bool force = false;           ///< Allow a folder that holds other files.
  bool plain_pictures = false;  ///< No enlargement or colour bar in depth.png and confidence.png.
  bool save_dsi = false;        ///< `mapWindowInto`: write the whole DSI.
  bool resume = false;          ///< `mapInto`: go on with the keyframes of an earlier run.
  bool needs_map = false;       ///< `mapInto`: give the map of a complete result, too.
  /// `mapInto`: a part of a planned map; null: none. This job must have the same options and
  /// recording. Either the keyframes of a shard are made, or all are there, made by shards, and the
  /// job makes the map of them.
  std::shared_ptr<const PlannedMap> plan;
  std::optional<KeyframeRange> shard;
  std::vector<std::shared_ptr<const SessionFile>> by_shards;
  /// Further files that are read: the result must not replace them.
  std::vector<std::filesystem::path> inputs;
  Verbosity verbosity = Verbosity::kQuiet;

  // Callbacks in the caller's thread; each may be empty.
  std::function<bool()> stop;  ///< Returns whether the job is to end as soon as possible.
  std::function<void(const std::vector<Warning>&)> warn;  ///< Receives each warning once.
  std::function<void(const std::string&)> note;
  std::function<void(const KeyframeDepthMap&, const RecordingKeyframes&)> on_keyframe;
  std::function<void(const RecordingKeyframes&)> on_last_keyframe;  ///< After the last keyframe.
  /// Receives the fraction of an activity that is done, 0 to 1, after each sample.
  std::function<void(const char* activity, double fraction)> on_progress;
  /// `mapWindowInto`: receives the planes of the DSI, before the keyframe, in any order and from
  /// several threads at once.
  std::function<void(int plane, int num_planes, const cv::Mat1f& values)> on_dsi_plane;

  /// Returns the prepared job of a program that gives options; its limits are those of the source.
  static MapJob of(RecordingSource source, const Options& options);

  /// Returns the recording for the options so far: the stride may be chosen later. It is the length
  /// of tracker noise that is constant over a keyframe.
  RecordingSource sourceNow() const;
  /// Returns all files that the job reads.
  std::vector<std::filesystem::path> allInputs() const;
  /// Takes the overrides of the source into the options, and reads calibration and hand-eye
  /// transform once.
  void prepare();
};

/// The result of a job.
struct MapResult {
  RunReport report;
  std::shared_ptr<const MapSnapshot> map;  ///< Never null.
  /// Why the recording was not mapped to its end, or a file of the result could not be written.
  std::optional<UserError> error;
  bool kept_earlier = false;  ///< There is no new result: the folder's earlier result stays.
  /// The content of report.json, if the result was complete before: `report` is empty, and so is
  /// `map`, unless `needs_map`.
  std::string complete_before;

  /// Throws the error, if there is one: std::invalid_argument for an option, else
  /// std::runtime_error.
  void rejectError() const;
  /// Returns whether there are keyframes, but no point.
  bool isWithoutPoints() const { return report.counts.keyframes > 0 && report.points == 0; }
};

/// Maps a recording: all that `event-fusion map` writes. If `stop` returns true during the mapping,
/// the result is that of the recording so far.
/// @throws Interrupted if `stop` returned true before the mapping; OptionError if an option is out
/// of range; std::exception if the options or the recording cannot be read, or a keyframe cannot be
/// written.
MapResult mapInto(MapJob job);

/// A shard cannot be made to its end. Its keyframes so far stay.
class ShardError : public std::runtime_error {
  using std::runtime_error::runtime_error;
};
/// The events of a planned window are not those of the plan: the part was read in another way.
class PartDiffers : public ShardError {
  using ShardError::ShardError;
};

/// Reads a recording to its end, and finds its keyframes without making them.
/// @throws as `mapInto`; std::invalid_argument naming an option with which keyframes depend on all
/// those before them; std::runtime_error if there is no keyframe.
PlannedMap planMap(MapJob job);

/// Maps the window `options.mapper.only_window`: all that `event-fusion depth` writes.
/// @throws as `mapInto`; Interrupted if `stop` returns true before the keyframe is made.
MapResult mapWindowInto(MapJob job);

}  // namespace efm
