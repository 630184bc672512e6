// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "plugin/checks/recording_statistics.h"
#include "plugin/engine/map_watcher.h"
#include "plugin/engine/mapper_driver.h"
#include "plugin/playback/error_text.h"
#include "plugin/playback/planned_map.h"
#include "plugin/playback/progress.h"
#include "plugin/recordings/streams/sample.h"
#include "plugin/results/output/report.h"

namespace efm {

/// Results of a first pass that the mapping uses.
struct FirstPass {
  std::vector<ChosenOption> chosen;  ///< The options that were automatic.
  RecordingStatistics statistics;    ///< Statistics of the events; the mapping adds the poses.
  QualityFacts quality;
  StageTimes times;  ///< Of `read` and `look`.
};

/// The keyframes of a recording, one after the other: feeds the recording to a mapper sample by
/// sample, with progress on stderr, and keeps the data for the report. In live operation the
/// recording is played at the speed of the sensor.
///
/// If the recording is damaged, the data before the damage are mapped.
class RecordingKeyframes {
 public:
  struct Host {
    /// Returns whether the recording is to end here. May be empty; its exceptions end the run.
    std::function<bool()> stop;
    /// Called after each sample, and before each planned keyframe. May be empty.
    std::function<void(double fraction)> on_progress;
    DsiSink* sink = nullptr;  ///< Receives every fused plane; may be null.
    /// What a pass over all events counted, if this run reads none; else null.
    const EventPass* known = nullptr;
  };

  /// @param recording must live longer than this object.
  /// @param activity its name in the progress.
  /// @throws std::invalid_argument if the options are not valid.
  RecordingKeyframes(Recording& recording, const EventFusionOptions& options, FirstPass first,
                     Verbosity verbosity, Host host, const std::string& activity = "mapping");

  /// Maps the recording until a keyframe is made.
  /// @return std::nullopt at the end, after an error, or if the host stopped.
  std::optional<KeyframeDepthMap> next();

  /// Returns the map so far.
  std::shared_ptr<const MapSnapshot> map() const { return mapper_->newest(true); }
  /// Returns the map so far, for watchers.
  /// @param watched_s time that the watchers took: it is left out of the rates.
  WatchedMap watched(const KeyframeDepthMap& newest, double watched_s) const;
  double seconds() const { return progress_.seconds(); }

  /// Returns what this run has counted.
  EventPass pass() const;
  /// Returns the damage of the recording, or why there is no keyframe; std::nullopt without error.
  const std::optional<UserError>& error() const { return error_; }
  /// Adds the results of the run to a report that has the warnings and doubts of the first look.
  /// Call it once, after the last keyframe.
  void describe(RunReport& report);

 private:
  template <typename Step>
  bool attempt(const Step& step, bool is_input = false);
  bool feedNext();
  std::optional<KeyframeDepthMap> takeMade();
  void waitForTimeOf(const Sample& sample);
  double fraction() const;
  void showProgress();
  std::string keyframeLine(const KeyframeDepthMap& keyframe);

  Recording& recording_;
  const EventFusionOptions options_;
  FirstPass first_;
  const Verbosity verbosity_;
  const Host host_;
  DepthStatistics depths_;
  std::optional<UserError> error_;
  bool stopped_ = false;
  bool ended_ = false;
  std::mutex made_mutex_;                 // guards made_
  std::deque<KeyframeDepthMap> made_;     // in live operation: not returned yet
  std::optional<std::int64_t> first_ns_;  // in live operation: time of the first sample
  std::chrono::steady_clock::time_point began_;
  std::size_t returned_ = 0;  // keyframes
  StageSeconds reported_;     // stage times until the last reported keyframe
  Progress progress_;
  std::shared_ptr<MapperDriver> mapper_;  // last, never null: its thread uses the others
};

/// Samples that were read once and can be read again without opening the recording, as long as
/// their events fit into a given memory.
class HeldRecording : public Recording {
 public:
  HeldRecording(std::unique_ptr<Recording> source, double max_mb)
      : source_(std::move(source)), bytes_left_(max_mb * 1e6) {}

  /// Returns the recording that is being read.
  Recording& source() { return *source_; }
  void hold(Sample sample);
  /// Ends the reading.
  void end();
  /// Returns whether it holds the whole recording.
  bool isWhole() const { return ended_ && bytes_left_ >= 0; }

  std::optional<Sample> read() override;
  std::string damage() const override { return source_->damage(); }
  const Rig& rig() const override { return source_->rig(); }
  std::vector<RecordedCamera> cameras() const override { return source_->cameras(); }
  std::string position() const override { return position_; }
  double progress() const override;
  RecordingCounts counts() const override { return source_->counts(); }

 private:
  struct Held {
    Sample sample;
    std::string position;
  };
  std::unique_ptr<Recording> source_;
  double bytes_left_;
  std::deque<Held> samples_;
  std::size_t num_samples_ = 0;
  bool ended_ = false;
  std::string position_;
};

}  // namespace efm
