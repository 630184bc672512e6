// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <deque>
#include <exception>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "mapping/keyframes/keyframe_mapper.h"
#include "maps/cloud/map_point.h"
#include "plugin/app/progress.h"
#include "plugin/options/option_file.h"
#include "plugin/results/output/report.h"
#include "plugin/session/hosted_mapping.h"
#include "plugin/session/map_watcher.h"
#include "plugin/session/recording_survey.h"
#include "plugin/session/sample.h"

namespace efm {

/// How to map a recording.
struct MappingJob {
  EventFusionOptions options;
  std::vector<ChosenOption> chosen;  ///< Those of them that were automatic.
  std::vector<Warning> warnings;     ///< Of the first pass; printed already.
  std::vector<std::string> doubts;   ///< Of the first pass: why the map rests on little evidence.
  Verbosity verbosity = Verbosity::kNormal;
  std::string activity = "mapping";  ///< For the progress.
  /// The value of `max_confidence = sequence`. Default: the running maximum.
  std::optional<double> sequence_maximum;

  /// Asked before each sample; where it says true, the rest of the recording is not mapped.
  /// May be empty.
  std::function<bool()> stop_requested;
  /// Receives each keyframe, in order.
  std::function<void(const KeyframeDepthMap&)> on_keyframe;
  /// See the map after each keyframe, in the thread that maps. Not owned.
  std::vector<MapWatcher*> watchers;
  /// Measures the stages of the mapping. Default: the processor time of the whole process.
  ProcessorClock processor_clock;
  /// Makes the receiver of the DSI's planes, of this number. Called once, as soon as the reference
  /// camera is known. May be empty.
  std::function<DsiSink*(const ReferenceView&, int num_planes)> make_dsi_sink;
};

/// The results of a run.
struct MappingOutcome {
  MapReport report;  ///< Without the times of the whole run.
  MapCloud::ConstPtr points;
  std::vector<StoredKeyframe> keyframes;
  /// T_world_ref of the keyframes at t_ref: in the map, and of the tracker.
  std::vector<StampedPose> trajectory;
  std::vector<StampedPose> tracker_trajectory;
  std::size_t told_warnings = 0;  ///< The first warnings of the report, which are printed already.
  std::size_t recalibrated_cameras = 0;  ///< Their recorded calibrations differ from the options'.
  /// Why the recording was not read to its end or has no keyframe.
  std::optional<std::string> error;
  bool misses_file = false;  ///< A file of the result could not be written.
};

/// Maps a recording, with progress on stderr. If reading stops with an error, the data before it
/// are mapped.
/// @throws std::invalid_argument if the options are not valid; the exceptions of `on_keyframe`, of
/// `make_dsi_sink` and of the watchers.
MappingOutcome runMapping(const MappingJob& job, Recording& recording);

/// The first of two passes: computes the robust maximum of the keyframes' confidences. Costs as
/// much as mapping the recording. An error of the recording ends it; `runMapping` reports the
/// error, and a requested stop ends it.
/// @param job whose receivers are not called.
/// @return nothing if there is no keyframe.
std::optional<double> sequenceMaximum(MappingJob job, Recording& recording);

/// The samples of a recording whose events fit into some memory. Then the recording is opened once
/// for two passes.
class HeldSamples {
 public:
  explicit HeldSamples(double max_mb) : bytes_left_(max_mb * 1e6) {}

  void add(Sample sample, std::string position);
  /// @param error that ended the recording; null: it was read to its end.
  void end(std::exception_ptr error);

  /// The recording again; null if it was not read to its end, or does not fit.
  /// @param read the recording that the samples come from.
  std::unique_ptr<Recording> recording(std::unique_ptr<Recording> read) &&;

 private:
  class HeldRecording;
  struct Held {
    Sample sample;
    std::string position;
  };
  double bytes_left_;
  std::deque<Held> samples_;
  std::exception_ptr error_;
  bool ended_ = false;
};

/// Reads a recording once. An error of the recording ends it: the pass that maps reports the error.
/// @param job whose receivers are not called.
/// @param held receives the samples.
/// @throws std::runtime_error naming a file of the options that cannot be read; Interrupted if a
/// stop was requested.
RecordingSurvey surveyRecording(const MappingJob& job, Recording& recording, HeldSamples& held);

}  // namespace efm
