// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/app/mapping_run.h"

#include <fmt/format.h>
#include <opencv2/core.hpp>

#include <algorithm>
#include <chrono>
#include <exception>
#include <mutex>
#include <numeric>
#include <thread>
#include <utility>

#include "mapping/depth/peak_fit.h"
#include "mapping/geometry/timestamp.h"
#include "plugin/app/interruption.h"
#include "plugin/app/program.h"
#include "plugin/app/recording_interval.h"
#include "plugin/session/health_checks.h"
#include "plugin/session/session_status.h"

namespace efm {
namespace {

/// The loop over a recording: reads, feeds the builder, delivers keyframes.
class Player {
 public:
  Player(const MappingJob& job, Recording& recording, StageTimes& times)
      : job_(job),
        recording_(recording),
        times_(times),
        depths_(job.options.mapper.keyframe.planes, job.chosen),
        progress_(job.activity, job.verbosity) {
    EventFusionOptions options = job.options;
    options.mapper.keyframe.sequence_maximum = job.sequence_maximum;
    options.validate();
    statistics_ = RecordingStatistics(statisticsOptions(options));
    HostedMapping::Callbacks callbacks;  // sessionWarnings summarises what the others say
    callbacks.on_keyframe = [this](const KeyframeDepthMap& keyframe) {
      if (!job_.options.live.enabled) return deliver(keyframe);
      const std::lock_guard<std::mutex> lock(made_mutex_);  // the mapping's own thread
      made_.push_back(keyframe);
    };
    mapping_ = hostMapping(options, {}, std::move(callbacks));
    if (job.processor_clock) mapping_->setClock(job.processor_clock);
  }

  /// @return the error that stopped it before the recording's end, if there was one.
  std::optional<std::string> play() {
    std::optional<std::string> error;
    for (bool more = true; more;) {
      if (job_.stop_requested && job_.stop_requested()) {
        stopped_at_ = fraction();
        break;
      }
      more = attempt([this] { return playOne(); }, error);
      deliverMade();
      if (delivery_error_) std::rethrow_exception(delivery_error_);
      if (progress_.due()) showProgress();
    }
    attempt([this] { return mapping_->finish(), false; }, error);
    deliverMade();
    if (delivery_error_) std::rethrow_exception(delivery_error_);
    showWatchers(true);
    return error;
  }

  HostedMapping& mapping() const { return *mapping_; }
  /// What is implausible about the recording and its depths. @param rig as it was used.
  std::vector<Warning> healthWarnings(const Rig& rig) {
    statistics_.setCameras(rig.cameras);
    const FusionMapperOptions& options = job_.options.mapper;
    const DepthPlanesOptions& planes = options.keyframe.planes;
    std::vector<Warning> warnings = efm::healthWarnings(
        statistics_,
        {motionDepth(planes, job_.chosen), planes.max_depth_m, options.trajectory.max_pose_gap_s});
    for (Warning& warning : depths_.warnings()) warnings.push_back(std::move(warning));
    return warnings;
  }
  const DepthStatistics& depths() const { return depths_; }
  /// The fraction of the recording that was mapped, if a stop was requested.
  std::optional<double> stoppedAt() const { return stopped_at_; }

 private:
  /// Runs a step. @return false if it throws. `error` keeps the first message.
  template <typename Step>
  static bool attempt(Step step, std::optional<std::string>& error) {
    try {
      return step();
    } catch (const std::exception& caught) {
      if (!error) error = inWords(caught);
      return false;
    }
  }

  /// @return false at the recording's end.
  bool playOne() {
    std::optional<Sample> sample;
    {
      const SecondsScope scope(times_.real.read, times_.cpu.read);
      sample = recording_.next();
    }
    if (!sample) return false;
    auto* const packet = std::get_if<EventPacket>(&*sample);
    const auto* const pose = std::get_if<PoseSample>(&*sample);
    if (packet) offerDsiSink(*packet);
    if (job_.options.live.enabled) waitForTimeOf(packet, pose);
    statistics_.add(*sample);
    try {
      if (packet) mapping_->addEvents(std::move(*packet));
      if (pose) mapping_->addPose(*pose);
    } catch (const std::invalid_argument& error) {
      throw std::invalid_argument(recording_.position() + ": " + error.what());
    }
    return true;
  }

  /// Live operation plays the recording at the speed of the sensor.
  void waitForTimeOf(const EventPacket* packet, const PoseSample* pose) {
    using Clock = std::chrono::steady_clock;
    if (!packet && !pose) return;
    const std::int64_t t_ns = pose                     ? pose->t_ns
                              : packet->events.empty() ? packet->t_ns.value_or(kMinTimeNs)
                                                       : packet->events.back().t_ns;
    if (!first_ns_) {
      first_ns_ = t_ns;
      began_ = Clock::now();
    }
    std::this_thread::sleep_until(began_ + std::chrono::nanoseconds(t_ns - *first_ns_));
  }

  /// In live operation: the keyframes that the mapping's thread has made, in this thread.
  void deliverMade() {
    std::vector<KeyframeDepthMap> made;
    {
      const std::lock_guard<std::mutex> lock(made_mutex_);
      made.swap(made_);
    }
    for (const KeyframeDepthMap& keyframe : made) deliver(keyframe);
  }

  /// The first packet of the reference camera tells the size of the DSI's planes.
  void offerDsiSink(const EventPacket& packet) {
    if (sink_offered_ || !job_.make_dsi_sink) return;
    const KeyframeMapperOptions& keyframe = job_.options.mapper.keyframe;
    if (packet.camera != keyframe.reference_camera) return;
    sink_offered_ = true;
    mapping_->setSink(job_.make_dsi_sink(makeReferenceView(packet.calibration.model, keyframe.view),
                                         keyframe.planes.num_planes));
  }

  /// An error of writing must not count as an error of reading: it is thrown after the step.
  void deliver(const KeyframeDepthMap& keyframe) {
    if (delivery_error_) return;
    depths_.add(keyframe);
    if (job_.verbosity == Verbosity::kVerbose) progress_.print(keyframeLine(keyframe));
    try {
      job_.on_keyframe(keyframe);
      if (!job_.watchers.empty()) newest_ = keyframe;
      showWatchers(false);
    } catch (...) {
      delivery_error_ = std::current_exception();
    }
  }

  void showWatchers(bool is_last) {
    if (!newest_) return;
    for (MapWatcher* watcher : job_.watchers) {
      const double start_s = progress_.seconds();
      if (watcher->due(is_last)) watcher->show(snapshotOf(*newest_));
      watched_s_ += progress_.seconds() - start_s;
    }
  }

  /// The map so far, with the rates of the mapping: without the time that the watchers took.
  WatchedMap snapshotOf(const KeyframeDepthMap& keyframe) const {
    const SessionStatus status = mapping_->status();
    const double seconds = std::max(progress_.seconds() - watched_s_, 1e-3);
    WatchedMap snapshot{keyframe,
                        job_.options.mapper.keyframe.planes,
                        mapping_->points(),
                        mapping_->keyframePoses().in_map,
                        {}};
    const double keyframes = static_cast<double>(status.counts.keyframes);
    const double read = static_cast<double>(status.counts.total().read);
    snapshot.lines = {
        fmt::format("{} keyframes, {} points", status.counts.keyframes, snapshot.points->size()),
        fmt::format("{:.2f} M events: {:.2f} M events/s, {:.1f} keyframes/s", 1e-6 * read,
                    1e-6 * read / seconds, keyframes / seconds)};
    if (status.events) {
      const double events_s = secondsBetween(status.events->first_ns, status.events->last_ns);
      snapshot.lines.push_back(fmt::format("{:.2f} s of the recording, {:.2g}x real time", events_s,
                                           events_s / seconds));
    }
    return snapshot;
  }

  void showProgress() {
    const SessionStatus status = mapping_->status();
    const double seconds = std::max(progress_.seconds(), 1e-3);
    std::string details =
        fmt::format("{} keyframes, {:.2g} M events/s", status.counts.keyframes,
                    1e-6 * static_cast<double>(status.counts.total().read) / seconds);
    if (status.events) {
      details +=
          fmt::format(", {:.2g}x real time",
                      secondsBetween(status.events->first_ns, status.events->last_ns) / seconds);
    }
    progress_.show(fraction(), details);
  }

  /// The fraction of the work that is done: of the events' time if its end is known, otherwise of
  /// the input.
  double fraction() const {
    const std::optional<TimeSpan> events = mapping_->status().events;
    const TimeLimits limits = job_.options.mapper.interval();
    if (!limits.t1_ns) return recording_.progress();
    if (!events) return 0;
    const std::int64_t first_ns = limits.t0_ns.value_or(events->first_ns);
    return std::clamp(
        secondsBetween(first_ns, events->last_ns) / secondsBetween(first_ns, *limits.t1_ns), 0.0,
        1.0);
  }

  /// For --verbose: what a keyframe has, and the time that its stages took.
  std::string keyframeLine(const KeyframeDepthMap& keyframe) {
    const SessionStatus status = mapping_->status();
    const StageSeconds& now = status.times.real;
    const StageSeconds before = std::exchange(told_, now);
    std::optional<std::int64_t> start_ns;
    if (status.events) start_ns = status.events->first_ns;
    return fmt::format(
        "keyframe {} at {}: {} events, {} depths; sweep {:.3f} s, depth {:.3f} s, refinement "
        "{:.3f} s",
        status.counts.keyframes, timeText(keyframe.window.t_ref_ns, start_ns),
        std::accumulate(keyframe.events.begin(), keyframe.events.end(), std::uint64_t{0}),
        cv::countNonZero(keyframe.map.depth), now.sweep - before.sweep, now.depth - before.depth,
        now.refine - before.refine);
  }

  const MappingJob& job_;
  Recording& recording_;
  StageTimes& times_;
  RecordingStatistics statistics_;
  DepthStatistics depths_;
  std::exception_ptr delivery_error_;  // of `on_keyframe`
  bool sink_offered_ = false;
  std::mutex made_mutex_;                 // of made_
  std::vector<KeyframeDepthMap> made_;    // in live operation, not delivered
  std::optional<std::int64_t> first_ns_;  // in live operation, of the first observation
  std::chrono::steady_clock::time_point began_;
  std::optional<double> stopped_at_;
  std::optional<KeyframeDepthMap> newest_;  // for the watchers
  double watched_s_ = 0;                    // in the watchers
  StageSeconds told_;                       // until the last keyframe
  Progress progress_;
  std::shared_ptr<HostedMapping> mapping_;  // last, never null: its thread uses the others
};

/// Reports the reference view and the shortest baseline, for disparities.
void describeView(const Rig& rig, const FusionMapperOptions& options, MapReport& report) {
  const auto reference = static_cast<std::size_t>(options.keyframe.reference_camera);
  if (reference >= rig.cameras.size()) return;
  report.view = makeReferenceView(rig.cameras[reference].model, options.keyframe.view);
  for (std::size_t c = 0; c < rig.cameras.size(); ++c) {
    if (c == reference || !isSelected(static_cast<int>(c), options.cameras)) continue;
    const double distance_m =
        (rig.cameras[c].T_rig_cam.translation - rig.cameras[reference].T_rig_cam.translation)
            .norm();
    if (distance_m == 0) continue;  // as good as one camera
    report.baseline_m = std::min(report.baseline_m.value_or(distance_m), distance_m);
  }
}

}  // namespace

MappingOutcome runMapping(const MappingJob& job, Recording& recording) {
  MappingOutcome outcome;
  StageTimes reading;
  Player player(job, recording, reading);
  outcome.error = player.play();

  SessionStatus status = player.mapping().status();
  if (outcome.error && status.events) {
    *outcome.error +=
        "; events were read until " + timeText(status.events->last_ns, status.events->first_ns);
  }
  status.counts.sorted_events += recording.counts().sorted_events;
  outcome.report.skipped_events = recording.counts().skipped_events;
  outcome.report.counts = status.counts;
  outcome.recalibrated_cameras = status.recalibrated_cameras;
  outcome.report.silent_keyframes = status.silent_keyframes;
  outcome.report.live = status.live;
  outcome.report.options = job.options;
  outcome.report.chosen = job.chosen;
  describeView(status.rig, job.options.mapper, outcome.report);
  outcome.report.sequence_maximum = job.sequence_maximum;
  outcome.report.stopped_at = player.stoppedAt();
  outcome.report.refinement = status.refinement;
  StageTimes& times = outcome.report.times;
  times = status.times;
  times.real.read = reading.real.read;
  times.cpu.read = reading.cpu.read;
  {
    const SecondsScope scope(times.real.map, times.cpu.output);
    outcome.points = player.mapping().points();
    outcome.keyframes = player.mapping().keyframes();
    KeyframePoses poses = player.mapping().keyframePoses();
    outcome.trajectory = std::move(poses.in_map);
    outcome.tracker_trajectory = std::move(poses.by_tracker);
  }
  describePoints(*outcome.points, outcome.report);
  outcome.report.pixels = player.depths().pixels();
  outcome.report.doubts = job.doubts;
  for (std::string& doubt : player.depths().doubts()) {
    outcome.report.doubts.push_back(std::move(doubt));
  }
  if (status.events) {
    outcome.report.recording_s = secondsBetween(status.events->first_ns, status.events->last_ns);
  }
  if (status.refinement && !outcome.trajectory.empty()) {
    outcome.report.pose_shift = shiftBetween(outcome.tracker_trajectory, outcome.trajectory);
  }
  std::vector<Warning>& warnings = outcome.report.warnings;
  warnings = job.warnings;
  outcome.told_warnings = warnings.size();
  for (Warning& warning : player.healthWarnings(status.rig)) {
    warnings.push_back(std::move(warning));
  }
  for (Warning& warning : sessionWarnings(status, job.options.mapper)) {
    warnings.push_back(std::move(warning));
  }
  for (Warning& warning : lossWarnings(recording.counts())) {
    warnings.push_back(std::move(warning));
  }
  if (status.counts.event_uses == 0 && !outcome.error && !player.stoppedAt()) {
    outcome.error = status.counts.keyframes == 0
                        ? "there is no keyframe: " + whyNoKeyframe(status, job.options.mapper)
                        : "no event of the keyframes' windows could be used";
  }
  return outcome;
}

std::optional<double> sequenceMaximum(MappingJob job, Recording& recording) {
  RobustMaximum maximum;
  job.activity = "first pass";
  if (job.verbosity == Verbosity::kVerbose) job.verbosity = Verbosity::kNormal;
  job.options.live.enabled = false;
  job.make_dsi_sink = nullptr;
  job.watchers.clear();
  job.on_keyframe = [&](const KeyframeDepthMap& keyframe) { maximum.add(keyframe.max_confidence); };
  StageTimes ignored;
  Player(job, recording, ignored).play();
  return maximum.value();
}

/// Plays held samples.
class HeldSamples::HeldRecording : public Recording {
 public:
  HeldRecording(HeldSamples held, std::unique_ptr<Recording> read)
      : held_(std::move(held)), read_(std::move(read)), size_(held_.samples_.size()) {}

  std::optional<Sample> next() override {
    if (held_.samples_.empty()) {
      if (held_.error_) std::rethrow_exception(held_.error_);
      return std::nullopt;
    }
    Held next = std::move(held_.samples_.front());
    held_.samples_.pop_front();
    position_ = std::move(next.position);
    return std::move(next.sample);
  }
  const Rig& rig() const override { return read_->rig(); }
  std::string position() const override { return position_; }
  double progress() const override {
    if (size_ == 0) return 1;
    return 1 - static_cast<double>(held_.samples_.size()) / static_cast<double>(size_);
  }
  RecordingCounts counts() const override { return read_->counts(); }

 private:
  HeldSamples held_;
  std::unique_ptr<Recording> read_;
  std::size_t size_;
  std::string position_;
};

void HeldSamples::add(Sample sample, std::string position) {
  bytes_left_ -= sizeof(Held);
  if (const auto* packet = std::get_if<EventPacket>(&sample)) {
    bytes_left_ -= static_cast<double>(packet->events.size() * sizeof(Event));
  }
  if (bytes_left_ < 0) {
    samples_.clear();
  } else {
    samples_.push_back({std::move(sample), std::move(position)});
  }
}

void HeldSamples::end(std::exception_ptr error) {
  error_ = std::move(error);
  ended_ = true;
}

std::unique_ptr<Recording> HeldSamples::recording(std::unique_ptr<Recording> read) && {
  if (!ended_ || bytes_left_ < 0) return nullptr;
  return std::make_unique<HeldRecording>(std::move(*this), std::move(read));
}

RecordingSurvey surveyRecording(const MappingJob& job, Recording& recording, HeldSamples& held) {
  RecordingSurveyor surveyor(job.options);
  Progress progress("first look", job.verbosity);
  std::exception_ptr error;
  while (true) {
    if (job.stop_requested && job.stop_requested()) throw Interrupted();
    std::optional<Sample> sample;
    try {
      sample = recording.next();
    } catch (const std::exception&) {
      error = std::current_exception();
    }
    if (!sample) break;
    try {
      surveyor.add(*sample);
    } catch (const std::exception&) {  // the mapping reports it
      return surveyor.finish();
    }
    held.add(std::move(*sample), recording.position());
    progress.show(recording.progress());
  }
  held.end(error);
  return surveyor.finish();
}

}  // namespace efm
