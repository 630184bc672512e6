// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/app/mapping_run.h"

#include <mrpt/obs/CObservation.h>

#include <fmt/format.h>

#include <algorithm>
#include <exception>
#include <utility>

#include "mapping/depth/robust_maximum.h"
#include "plugin/app/progress.h"
#include "plugin/app/recording_interval.h"
#include "plugin/mrpt/CEventFusionMapBuilder.h"
#include "plugin/mrpt/CObservationEvents.h"
#include "plugin/session/no_keyframe.h"

namespace efm {
namespace {

/// The loop over a recording: reads, feeds the builder, delivers keyframes.
class Player {
 public:
  Player(const MappingJob& job, Recording& recording, StageTimes& times)
      : job_(job), recording_(recording), times_(times) {
    EventFusionOptions options = job.options;
    options.mapper.keyframe.sequence_maximum = job.sequence_maximum;
    builder_.setOptions(options);
    builder_.setMinLoggingLevel(mrpt::system::LVL_ERROR);  // warningsOf summarises its warnings
    if (job.processor_clock) builder_.setProcessorClock(job.processor_clock);
    builder_.setKeyframeCallback([this](const KeyframeDepthMap& keyframe) { deliver(keyframe); });
  }

  /// @return the error that stopped it before the recording's end, if there was one.
  std::optional<std::string> play() {
    std::optional<std::string> error;
    for (bool more = true; more;) {
      if (job_.stop_requested && job_.stop_requested()) {
        stopped_at_ = recording_.progress();
        break;
      }
      more = attempt([this] { return playOne(); }, error);
      if (delivery_error_) std::rethrow_exception(delivery_error_);
      if (progress_.due()) showProgress();
    }
    attempt([this] { return builder_.finish(), false; }, error);
    if (delivery_error_) std::rethrow_exception(delivery_error_);
    return error;
  }

  const CEventFusionMapBuilder& builder() const { return builder_; }
  /// The fraction of the recording that was mapped, if a stop was requested.
  std::optional<double> stoppedAt() const { return stopped_at_; }

 private:
  /// Runs a step. @return false if it throws. `error` keeps the first message.
  template <typename Step>
  static bool attempt(Step step, std::optional<std::string>& error) {
    try {
      return step();
    } catch (const std::exception& caught) {
      if (!error) error = caught.what();
      return false;
    }
  }

  /// @return false at the recording's end.
  bool playOne() {
    mrpt::obs::CObservation::Ptr observation;
    {
      const SecondsScope scope(times_.real.read, times_.cpu.read);
      observation = recording_.next();
    }
    if (!observation) return false;
    offerDsiSink(*observation);
    try {
      builder_.processObservation(observation);
    } catch (const std::invalid_argument& error) {
      throw std::invalid_argument(recording_.position() + ": " + error.what());
    }
    return true;
  }

  /// The first packet of the reference camera tells the size of the DSI's planes.
  void offerDsiSink(const mrpt::obs::CObservation& observation) {
    if (sink_offered_ || !job_.make_dsi_sink) return;
    const auto* events = dynamic_cast<const CObservationEvents*>(&observation);
    if (!events || events->camera_index != job_.options.mapper.keyframe.reference_camera) return;
    sink_offered_ = true;
    builder_.setDsiSink(
        job_.make_dsi_sink(makeReferenceView(events->camera, job_.options.mapper.keyframe.view)));
  }

  /// An error of writing must not count as an error of reading: it is thrown after the step.
  void deliver(const KeyframeDepthMap& keyframe) {
    if (delivery_error_) return;
    try {
      job_.on_keyframe(keyframe);
    } catch (...) {
      delivery_error_ = std::current_exception();
    }
  }

  void showProgress() {
    progress_.show(fmt::format("{:3.0f} %, {} keyframes", 100 * recording_.progress(),
                               builder_.status().counts.keyframes));
  }

  const MappingJob& job_;
  Recording& recording_;
  StageTimes& times_;
  CEventFusionMapBuilder builder_;
  std::exception_ptr delivery_error_;  // of `on_keyframe`
  bool sink_offered_ = false;
  std::optional<double> stopped_at_;
  Progress progress_;
};

std::vector<std::string> warningsOf(const SessionStatus& status, bool exclude_silent) {
  std::vector<std::string> warnings;
  if (status.counts.sorted_events > 0) {
    warnings.push_back(fmt::format("{} events came later than newer ones and were sorted",
                                   status.counts.sorted_events));
  }
  for (std::size_t c = 0; c < status.counts.cameras.size(); ++c) {
    const EventCounts& events = status.counts.cameras[c];
    if (events.outside_lens == 0) continue;
    warnings.push_back(
        fmt::format("{} of {} events of camera {} were not used: its lens model has no viewing ray "
                    "for their pixels (outside_lens)",
                    events.outside_lens, events.read, c));
  }
  for (std::size_t c = 0; c < status.silent_keyframes.size(); ++c) {
    if (status.silent_keyframes[c] == 0) continue;
    warnings.push_back(fmt::format(
        "camera {} had no event in {} of {} keyframes: {}", c, status.silent_keyframes[c],
        status.counts.keyframes,
        exclude_silent ? "the others were fused without it"
                       : "rules that ask all cameras (min, harmonic, geometric) find nothing there "
                         "([rig] exclude_silent leaves silent cameras out)"));
  }
  if (status.counts.silent_subintervals > 0) {
    warnings.push_back(
        fmt::format("{} sub-intervals of a camera had no event: rules that ask all of them (min, "
                    "harmonic, geometric) find nothing where one is empty",
                    status.counts.silent_subintervals));
  }
  for (const auto& [source, count] : status.other_poses) {
    if (!status.pose_source) break;  // no keyframe: the error says so
    warnings.push_back(fmt::format("{} poses were not used: {}, beside {}", count, asText(source),
                                   asText(*status.pose_source)));
  }
  if (status.counts.duplicate_poses > 0) {
    warnings.push_back(fmt::format("{} poses had the time of an earlier one and were left out",
                                   status.counts.duplicate_poses));
  }
  if (status.refinement && status.refinement->counts.registered + 1 < status.counts.keyframes) {
    warnings.push_back(fmt::format(
        "{} of {} keyframes found no place by their points: the tracker's motion stands there",
        status.counts.keyframes - 1 - status.refinement->counts.registered,
        status.counts.keyframes));
  }
  if (status.counts.keyframes > 0 && status.counts.keyframes_without_pose > 0) {
    warnings.push_back(fmt::format("{} windows were left out: no pose at their reference time",
                                   status.counts.keyframes_without_pose));
  }
  if (status.counts.keyframes > 0 && status.counts.windows_without_events > 0) {
    warnings.push_back(fmt::format("{} windows were left out: the selected cameras saw nothing",
                                   status.counts.windows_without_events));
  }
  return warnings;
}

/// Reports the reference view and the shortest baseline, for disparities.
void describeView(const Rig& rig, const FusionMapperOptions& options, MapReport& report) {
  const auto reference = static_cast<std::size_t>(options.keyframe.reference_camera);
  if (reference >= rig.cameras.size()) return;
  report.view = makeReferenceView(rig.cameras[reference].model, options.keyframe.view);
  for (std::size_t c = 0; c < rig.cameras.size(); ++c) {
    const auto& used = options.cameras;
    const bool takes_part =
        used.empty() || std::count(used.begin(), used.end(), static_cast<int>(c)) > 0;
    if (c == reference || !takes_part) continue;
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

  SessionStatus status = player.builder().status();
  status.counts.sorted_events += recording.counts().sorted_events;
  outcome.report.counts = status.counts;
  outcome.recalibrated_cameras = status.recalibrated_cameras;
  outcome.report.silent_keyframes = status.silent_keyframes;
  outcome.report.options = job.options;
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
    outcome.points = player.builder().points();
    player.builder().getCurrentlyBuiltMap(outcome.keyframes);
    outcome.trajectory = player.builder().trajectory();
    outcome.tracker_trajectory = player.builder().trackerTrajectory();
  }
  outcome.report.points = outcome.points.size();
  outcome.warnings = warningsOf(status, job.options.mapper.keyframe.exclude_silent);
  for (std::string& warning : lossWarnings(recording.counts())) {
    outcome.warnings.push_back(std::move(warning));
  }
  if (status.counts.event_uses == 0 && !outcome.error && !player.stoppedAt()) {
    outcome.error = status.counts.keyframes == 0
                        ? "there is no keyframe: " + whyNoKeyframe(status, job.options.mapper)
                        : "no event of the keyframes' windows could be used";
  }
  return outcome;
}

std::optional<double> sequenceMaximum(const EventFusionOptions& options, Recording& recording) {
  RobustMaximum maximum;
  MappingJob job;
  job.options = options;
  job.on_keyframe = [&](const KeyframeDepthMap& keyframe) { maximum.add(keyframe.max_confidence); };
  StageTimes ignored;
  Player(job, recording, ignored).play();
  return maximum.value();
}

}  // namespace efm
