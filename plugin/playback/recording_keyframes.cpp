// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/playback/recording_keyframes.h"

#include <fmt/format.h>
#include <opencv2/core.hpp>

#include <algorithm>
#include <numeric>
#include <stdexcept>
#include <thread>
#include <utility>

#include "mapping/geometry/timestamp.h"

namespace efm {

RecordingKeyframes::RecordingKeyframes(Recording& recording, const EventFusionOptions& options,
                                       FirstPass first, Verbosity verbosity, Host host,
                                       const std::string& activity)
    : recording_(recording),
      options_(options),
      first_(std::move(first)),
      verbosity_(verbosity),
      host_(std::move(host)),
      depths_(options.mapper.keyframe.planes, first_.chosen),
      progress_(activity, verbosity) {
  options.validate();
  first_.statistics.setWindow(statisticsOptions(options).window_s);
  Mapper::Callbacks callbacks;  // other messages are summarised in the warnings
  if (options.live.enabled) {
    callbacks.on_keyframe = [this](const KeyframeDepthMap& keyframe) {
      const std::lock_guard<std::mutex> lock(made_mutex_);
      made_.push_back(keyframe);
    };
  }
  EventFusionOptions of_rig = options;
  of_rig.rig = {};  // the recording has its files
  of_rig.rig.pose_source = options.rig.pose_source;
  of_rig.session_file.clear();  // the result's folder has it
  mapper_ = MapperDriver::make(of_rig, std::move(callbacks), {}, first_.quality);
  mapper_->setSink(host_.sink);
  mapper_->pullKeyframes();
  attempt([this] { mapper_->addCameras(recording_.rig()); }, true);
}

/// Runs a step. The run's error is the first exception. If the mapper rejects input, the text
/// begins with its position in the recording, and an OptionError without a section is about the
/// input, not about options. @return false if the step throws.
template <typename Step>
bool RecordingKeyframes::attempt(const Step& step, bool is_input) {
  try {
    step();
    return true;
  } catch (const std::exception& caught) {
    if (error_) return false;
    error_ = userError(caught);
    if (!is_input || dynamic_cast<const std::invalid_argument*>(&caught) == nullptr) return false;
    error_->text = recording_.position() + ": " + error_->text;
    if (error_->wrong && error_->wrong->section.empty()) error_->wrong.reset();
    return false;
  }
}

std::optional<KeyframeDepthMap> RecordingKeyframes::next() {
  const bool is_planned = !options_.mapper.planned_windows.empty();
  if (is_planned) {  // many keyframes may come after the last sample
    if (host_.on_progress) host_.on_progress(fraction());
    if (progress_.due()) showProgress();
    stopped_ = stopped_ || (ended_ && host_.stop && host_.stop());
    if (stopped_) return std::nullopt;
  }
  while (true) {
    std::optional<KeyframeDepthMap> made;
    const bool maps = attempt([&] { made = options_.live.enabled ? takeMade() : mapper_->next(); });
    if (made) {
      made->after_stop = stopped_;
      depths_.add(*made);
      ++returned_;
      if (verbosity_ == Verbosity::kVerbose) progress_.print(keyframeLine(*made));
      return made;
    }
    if (ended_) return std::nullopt;
    stopped_ = host_.stop && host_.stop();
    ended_ = !maps || stopped_ || !feedNext();
    if (ended_) {
      if (stopped_ && is_planned) return std::nullopt;  // the next windows lack their events
      attempt([this] { mapper_->finish(); });
      continue;
    }
    if (progress_.due()) showProgress();
    if (host_.on_progress) host_.on_progress(fraction());
  }
}

/// Takes the first keyframe that waits, in live operation.
std::optional<KeyframeDepthMap> RecordingKeyframes::takeMade() {
  const std::lock_guard<std::mutex> lock(made_mutex_);
  if (made_.empty()) return std::nullopt;
  std::optional<KeyframeDepthMap> first(std::move(made_.front()));
  made_.pop_front();
  return first;
}

/// @return false at the end of the recording, or after an error.
bool RecordingKeyframes::feedNext() {
  std::optional<Sample> sample;
  const bool is_read = attempt([&] {
    const StageScope scope(&first_.times, &StageSeconds::read, Processors::kThis);
    sample = recording_.read();
  });
  if (!sample) {
    const std::string damage = is_read ? recording_.damage() : std::string();
    if (!damage.empty() && !error_) error_ = userError(std::runtime_error(damage));
    return false;
  }
  if (options_.live.enabled) waitForTimeOf(*sample);
  if (std::holds_alternative<PoseSample>(*sample)) first_.statistics.add(*sample);
  return attempt([&] { mapper_->add(std::move(*sample)); }, true);
}

void RecordingKeyframes::waitForTimeOf(const Sample& sample) {
  std::int64_t t_ns = 0;
  if (const auto* pose = std::get_if<PoseSample>(&sample)) {
    t_ns = pose->t_ns;
  } else if (const auto* packet = std::get_if<EventPacket>(&sample)) {
    t_ns = packet->events.back().t_ns;
  } else {
    return;
  }
  if (!first_ns_) {
    first_ns_ = t_ns;
    began_ = std::chrono::steady_clock::now();
  }
  std::this_thread::sleep_until(began_ + std::chrono::nanoseconds(t_ns - *first_ns_));
}

WatchedMap RecordingKeyframes::watched(const KeyframeDepthMap& newest, double watched_s) const {
  const SessionStatus status = mapper_->status();
  const auto map = mapper_->newest(true);
  const double seconds = std::max(progress_.seconds() - watched_s, 1e-3);
  const double read = static_cast<double>(status.counts.total().read);
  WatchedMap watched{newest, options_.mapper.keyframe.planes, map->points, map->trajectory, {}};
  watched.lines = {
      fmt::format("{} keyframes, {} points", status.counts.keyframes, map->points->size()),
      fmt::format("{:.2f} M events: {:.2f} M events/s, {:.1f} keyframes/s", 1e-6 * read,
                  1e-6 * read / seconds, static_cast<double>(status.counts.keyframes) / seconds)};
  if (status.events) {
    const double events_s = secondsBetween(status.events->first_ns, status.events->last_ns);
    watched.lines.push_back(
        fmt::format("{:.2f} s of the recording, {:.2g}x real time", events_s, events_s / seconds));
  }
  return watched;
}

void RecordingKeyframes::showProgress() {
  const SessionStatus status = mapper_->status();
  const double seconds = std::max(progress_.seconds(), 1e-3);
  std::string details = fmt::format("{} keyframes", status.counts.keyframes);
  if (status.events) {  // a join reads none
    details +=
        fmt::format(", {:.2g} M events/s, {:.2g}x real time",
                    1e-6 * static_cast<double>(status.counts.total().read) / seconds,
                    secondsBetween(status.events->first_ns, status.events->last_ns) / seconds);
  }
  progress_.show(fraction(), details);
}

/// Computed from the keyframes if they are planned, from the events' time if its end is known,
/// otherwise from the input.
double RecordingKeyframes::fraction() const {
  if (const std::size_t planned = options_.mapper.planned_windows.size(); planned > 0) {
    return static_cast<double>(returned_) / static_cast<double>(planned);
  }
  const TimeLimits limits = options_.mapper.interval();
  if (!limits.t1_ns) return recording_.progress();
  const std::optional<TimeSpan> events = mapper_->status().events;
  if (!events) return 0;
  const std::int64_t first_ns = limits.t0_ns.value_or(events->first_ns);
  return std::clamp(
      secondsBetween(first_ns, events->last_ns) / secondsBetween(first_ns, *limits.t1_ns), 0.0,
      1.0);
}

/// Returns the line of a keyframe for --verbose: its contents, and the times of its stages.
std::string RecordingKeyframes::keyframeLine(const KeyframeDepthMap& keyframe) {
  const SessionStatus status = mapper_->status();
  const StageSeconds& now = status.times.real;
  const StageSeconds before = std::exchange(reported_, now);
  std::optional<std::int64_t> start_ns;
  if (status.events) start_ns = status.events->first_ns;
  return fmt::format(
      "keyframe {} at {}: {} events, {} depths; sweep {:.3f} s, depth {:.3f} s, motion {:.3f} s, "
      "refinement {:.3f} s",
      returned_, timeText(keyframe.window.t_ref_ns, start_ns),
      std::accumulate(keyframe.events.begin(), keyframe.events.end(), std::uint64_t{0}),
      cv::countNonZero(keyframe.map.depth), now.rays + now.sweep - before.rays - before.sweep,
      now.depth - before.depth, now.motion - before.motion, now.refine - before.refine);
}

namespace {

/// Reports the reference view and the shortest baseline, for disparities.
void describeView(const Rig& rig, const FusionMapperOptions& options, RunReport& report) {
  const auto reference = static_cast<std::size_t>(options.keyframe.reference_camera);
  if (reference >= rig.cameras.size()) return;
  report.view = makeReferenceView(rig.cameras[reference].model, options.keyframe.view);
  for (std::size_t c = 0; c < rig.cameras.size(); ++c) {
    if (c == reference || !isSelected(static_cast<int>(c), options.cameras)) continue;
    const double distance_m = baselineOf(rig.cameras[c], rig.cameras[reference]);
    if (distance_m == 0) continue;  // equal to a single camera
    report.baseline_m = std::min(report.baseline_m.value_or(distance_m), distance_m);
  }
}

}  // namespace

EventPass RecordingKeyframes::pass() const {
  const SessionStatus status = mapper_->status();
  EventPass pass{status.counts, status.events, recording_.counts(), error_ ? error_->text : "", {}};
  for (const auto& [source, count] : status.other_poses) {
    const bool is_better = status.pose_source && source.kind < status.pose_source->kind;
    if (is_better && options_.rig.pose_source.empty()) pass.better_source = source;
  }
  return pass;
}

void RecordingKeyframes::describe(RunReport& report) {
  SessionStatus status = mapper_->status();
  RecordingCounts read = recording_.counts();
  if (host_.known != nullptr) {
    host_.known->addTo(status, read);
    if (!error_ && !host_.known->error.empty()) error_ = UserError{host_.known->error};
  }
  const FusionMapperOptions& options = options_.mapper;
  const DepthPlanesOptions& planes = options.keyframe.planes;
  if (error_ && status.events) {
    error_->add("; events were read until " +
                timeText(status.events->last_ns, status.events->first_ns));
  }
  status.counts.sorted_events += read.sorted_events;
  report.skipped_events = read.skipped_events;
  report.counts = status.counts;
  report.motion = motionText(status, options);
  report.silent_keyframes = status.silent_keyframes;
  report.live = status.live;
  report.options = options_;
  report.chosen = first_.chosen;
  describeView(status.rig, options, report);
  report.sequence_maximum = options.keyframe.sequence_maximum;
  if (stopped_) report.stopped_at = fraction();
  report.refinement = status.refinement;
  report.times = status.times;
  for (auto StageSeconds::*stage : {&StageSeconds::read, &StageSeconds::look}) {
    report.times.real.*stage = first_.times.real.*stage;
    report.times.cpu.*stage = first_.times.cpu.*stage;
  }
  report.pixels = depths_.pixels();
  report.quality = status.quality;
  if (status.events) {
    report.recording_s = secondsBetween(status.events->first_ns, status.events->last_ns);
  }
  Findings findings{first_.statistics, read};
  findings.use(planes, first_.chosen);
  findings.max_pose_gap_s = options.trajectory.max_pose_gap_s;
  findings.checks = options_.checks;
  findings.voxel_size_m = report.options.cloud.voxel_size_m;
  if (stopped_ && status.events) findings.until_ns = status.events->last_ns;
  findings.session = &status;
  findings.options = &options;
  findings.depths = &depths_;
  append(report.warnings, warningsOf(findings));
  append(report.notes, std::move(status.pose_notes));
  dropExplainedBlur(report.warnings);
  if (status.counts.event_uses > 0 || error_ || stopped_) return;
  const bool outside = !status.events && !recording_.rig().cameras.empty() &&
                       (options.interval().t0_ns || options.interval().t1_ns);
  if (status.counts.keyframes > 0) {
    error_ = {"no event of the keyframes' windows could be used"};
    return;
  }
  const OptionHint why =
      outside ? noEventText(options.interval(), read) : whyNoKeyframe(status, options);
  error_ = {std::string("there is no keyframe: ") + why.what(), why.options};
}

void HeldRecording::hold(Sample sample) {
  bytes_left_ -= sizeof(Held);
  if (const auto* packet = std::get_if<EventPacket>(&sample)) {
    bytes_left_ -= static_cast<double>(packet->events.size() * sizeof(Event));
  }
  if (bytes_left_ < 0) {
    samples_.clear();
  } else {
    samples_.push_back({std::move(sample), source_->position()});
  }
}

void HeldRecording::end() {
  ended_ = true;
  num_samples_ = samples_.size();
}

std::optional<Sample> HeldRecording::read() {
  if (samples_.empty()) return std::nullopt;
  Held next = std::move(samples_.front());
  samples_.pop_front();
  position_ = std::move(next.position);
  return std::move(next.sample);
}

double HeldRecording::progress() const {
  if (num_samples_ == 0) return 1;
  return 1 - static_cast<double>(samples_.size()) / static_cast<double>(num_samples_);
}

}  // namespace efm
