// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <chrono>
#include <cstddef>
#include <deque>
#include <exception>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "plugin/app/program.h"
#include "plugin/app/progress.h"
#include "plugin/results/output/report.h"
#include "plugin/session/map_watcher.h"
#include "plugin/session/mapper.h"
#include "plugin/session/recording_statistics.h"
#include "plugin/session/sample.h"

namespace efm {

/// What a first pass found, and the mapping goes on with.
struct FirstPass {
  std::vector<ChosenOption> chosen;  ///< The options that were automatic.
  RecordingStatistics statistics;    ///< Of the events; the mapping adds the poses.
};

/// Feeds a recording to a mapper sample by sample, with progress on stderr, and keeps what the
/// report needs. In live operation the recording is played at the speed of the sensor.
///
/// If the recording is damaged, what comes before the damage is mapped.
class MappingRun {
 public:
  /// Gets each keyframe, in order, in the caller's thread. What it throws ends the run.
  using Receive = std::function<void(const KeyframeDepthMap&, const MappingRun&)>;

  /// @param recording outlives this.
  /// @throws std::invalid_argument if the options are not valid.
  MappingRun(Recording& recording, const EventFusionOptions& options, FirstPass first,
             Verbosity verbosity, Receive receive, const std::string& activity = "mapping");

  Mapper& mapper() { return *mapper_; }

  /// Maps the next sample. @return false at the end of the recording, or at its damage.
  bool mapNext();
  /// Maps the rest.
  void finish();

  /// The fraction of the work that is done, 0 to 1.
  double fraction() const;
  /// The map so far, for those who watch it grow.
  /// @param watched_s the time that they took: the rates are without it.
  WatchedMap watched(const KeyframeDepthMap& newest, double watched_s) const;
  double seconds() const { return progress_.seconds(); }

  /// The damage of the recording, or why there is no keyframe; std::nullopt if the map is complete.
  const std::optional<UserError>& error() const { return error_; }
  /// Adds what the run found to a report, which has the warnings and doubts of the first look. To
  /// be called once, after `finish`.
  /// @param stopped the user ended the run.
  void describe(MapReport& report, bool stopped);

 private:
  template <typename Step>
  bool attempt(const Step& step);
  void noteError(const std::exception& caught);
  bool feedNext();
  void deliver(const KeyframeDepthMap& keyframe);
  void deliverMade();
  void waitForTimeOf(const Sample& sample);
  void showProgress();
  std::string keyframeLine(const KeyframeDepthMap& keyframe);

  Recording& recording_;
  const EventFusionOptions options_;
  FirstPass first_;
  const Verbosity verbosity_;
  const Receive receive_;
  StageTimes reading_;
  DepthStatistics depths_;
  std::exception_ptr receive_error_;
  std::optional<UserError> error_;
  bool rejected_ = false;                 // a sample, by the mapper
  std::mutex made_mutex_;                 // of made_
  std::vector<KeyframeDepthMap> made_;    // in live operation, not delivered
  std::optional<std::int64_t> first_ns_;  // in live operation, of the first sample
  std::chrono::steady_clock::time_point began_;
  StageSeconds told_;  // until the last keyframe
  Progress progress_;
  std::shared_ptr<Mapper> mapper_;  // last, never null: its thread uses the others
};

/// Samples that were read once, to be read again without opening the recording: as long as their
/// events fit into some memory.
class HeldRecording : public Recording {
 public:
  HeldRecording(std::unique_ptr<Recording> read, double max_mb)
      : read_(std::move(read)), bytes_left_(max_mb * 1e6) {}

  /// The recording that is read now.
  Recording& read() { return *read_; }
  void hold(Sample sample);
  /// @param error that ended the recording, or null.
  void end(std::exception_ptr error);
  /// Whether it holds all of the recording.
  bool isWhole() const { return ended_ && bytes_left_ >= 0; }

  std::optional<Sample> next() override;
  const Rig& rig() const override { return read_->rig(); }
  std::string position() const override { return position_; }
  double progress() const override;
  RecordingCounts counts() const override { return read_->counts(); }

 private:
  struct Held {
    Sample sample;
    std::string position;
  };
  std::unique_ptr<Recording> read_;
  double bytes_left_;
  std::deque<Held> samples_;
  std::size_t num_samples_ = 0;
  std::exception_ptr error_;
  bool ended_ = false;
  std::string position_;
};

}  // namespace efm
