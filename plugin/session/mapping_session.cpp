// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/session/mapping_session.h"

#include <fmt/format.h>

#include <algorithm>
#include <exception>
#include <iterator>
#include <stdexcept>
#include <utility>

#include "mapping/geometry/rigid3.h"
#include "mapping/geometry/timestamp.h"

namespace efm {
namespace {

/// Adds input to the first look. Input that the first look rejects is rejected by the mapping, too.
template <typename Add>
void look(Add add) {
  try {
    add();
  } catch (const std::invalid_argument&) {
  }
}

/// Measures the stages of the mapping, which do not overlap.
class StageTimer : public StageHook {
 public:
  /// @param clock processor time of all threads of the mapping.
  StageTimer(StageTimes& times, const ProcessorClock& clock) : times_(times), clock_(clock) {}

  void begin(Stage stage) override {
    double StageSeconds::*const sum = stage == Stage::kFilter  ? &StageSeconds::filter
                                      : stage == Stage::kSweep ? &StageSeconds::sweep
                                                               : &StageSeconds::depth;
    scope_.emplace(times_.real.*sum, times_.cpu.*sum, clock_);
  }
  void end(Stage) override { scope_.reset(); }

 private:
  StageTimes& times_;
  const ProcessorClock& clock_;
  std::optional<SecondsScope> scope_;
};

}  // namespace

MappingSession::MappingSession(const EventFusionOptions& options)
    : automatic_(options.automatic),
      options_(options),
      pose_source_(options.rig.pose_source),
      guard_(options.live),
      mapper_(mapperOptions(options)),
      cloud_(options.cloud, options.movableKeyframes()) {
  if (!options.live.enabled && options.automatic.any()) {  // live operation cannot look ahead
    first_look_ = std::make_unique<FirstLook>(options);
  }
  if (options.refinement.enabled) {
    refinement_ = std::make_unique<MapRefinement>(options.refinement);
  }
}

void MappingSession::addCameras(const Rig& rig) {
  const SecondsScope scope(status_.times.real.tables, status_.times.cpu.tables, processSeconds);
  if (first_look_) first_look_->take(rig);
  for (const RigCamera& camera : rig.cameras) mapper_.addCamera(camera);
}

void MappingSession::addEvents(EventPacket packet) {
  if (guard_.clockWentBack()) {
    const std::size_t events = packet.events.size();
    guard_.hold([this, held = std::move(packet)]() mutable { addEvents(std::move(held)); }, events);
    return;
  }
  if (first_look_) look([&] { first_look_->addEvents(packet); });
  const int camera = packet.camera;
  const std::uint64_t complete = mapper_.readEvents() + packet.events.size();
  std::optional<std::int64_t> older_ns;
  try {
    older_ns = guard_.admit(mapper_, packet);
    feed(std::move(packet));
  } catch (...) {  // contradicts its camera, or no memory
    status_.rejected_events[camera] += complete - mapper_.readEvents();
    if (older_ns) guard_.noteOlder(camera, *older_ns);
    throw;
  }
}

void MappingSession::feed(EventPacket packet) {
  const std::int64_t offset_ns =
      mapper_.rig().cameras.at(static_cast<std::size_t>(packet.camera)).time_offset_ns;
  const bool empty = packet.events.empty();
  const std::int64_t first_ns = empty ? 0 : packet.events.front().t_ns;
  const std::int64_t last_ns = empty ? 0 : packet.events.back().t_ns;
  {
    const SecondsScope scope(status_.times.real.filter, status_.times.cpu.filter);
    mapper_.addEvents(packet.camera, std::move(packet.events));
  }
  if (packet.complete_until_ns) mapper_.setCompleteUntil(packet.camera, *packet.complete_until_ns);
  if (empty) {
    if (!packet.complete_until_ns) return;
    guard_.dropMissing(mapper_, packet.camera,
                       trajectoryTime(*packet.complete_until_ns, offset_ns));
    return;
  }
  guard_.dropMissing(mapper_, packet.camera, std::max(first_ns, last_ns) + offset_ns);
  const std::int64_t begin_ns = first_ns + offset_ns;
  guard_.noteInTime(packet.camera, begin_ns);
  if (!status_.events) segment_.begin_ns = begin_ns;
  extend(status_.events, begin_ns);
  extend(status_.events, last_ns + offset_ns);
  newest_begin_ns_ = std::max(newest_begin_ns_.value_or(begin_ns), begin_ns);
  guard_.dropOverdue(mapper_, *newest_begin_ns_);
  if (*newest_begin_ns_ - status_.events->first_ns > kMaxSourceWaitNs ||
      guard_.fillsQueue(mapper_.heldEvents())) {
    useSelected();
  }
}

void MappingSession::addPose(const PoseSample& sample) {
  if (guard_.clockWentBack()) {
    guard_.hold([this, sample] {
      try {
        addPose(sample);
      } catch (const std::invalid_argument&) {
        guard_.countRejectedPose();
      }
    });
    return;
  }
  if (first_look_) look([&] { first_look_->addPose(sample); });
  const StampedPose pose{sample.t_ns, sample.T_world_rig()};
  const PoseSourceId& source = sample.source;
  const std::vector<StampedPose> poses = pose_source_.add(source, pose);
  try {
    for (const StampedPose& next : poses) usePose({next, sample.noise});
  } catch (const std::invalid_argument&) {
    guard_.noteOlderPose(pose.t_ns);
    throw;
  }
  if (!poses.empty()) guard_.noteInTime(LiveGuard::kTracker, pose.t_ns);
  const bool used = !pose_source_.selected() || *pose_source_.selected() == source;
  // If two poses have the same time, the first one is used, and so is its noise.
  if (refinement_ && used) noises_[source].try_emplace(pose.t_ns, sample.noise);
}

/// Returns the stated noise of the last pose up to a time. Forgets the noise of earlier poses.
std::optional<PoseNoise> MappingSession::noiseAt(std::int64_t t_ns) {
  if (!pose_source_.selected()) return std::nullopt;
  auto& noises = noises_[*pose_source_.selected()];
  const auto after = noises.upper_bound(t_ns);
  if (after == noises.begin()) return std::nullopt;
  noises.erase(noises.begin(), std::prev(after));
  return noises.begin()->second;
}

void MappingSession::usePose(const NoisyPose& pose) {
  if (guard_.holdsPose(pose)) return;
  mapper_.addPose(pose.pose);
  extend(status_.poses, pose.pose.t_ns);
  guard_.notePose(pose.pose);
}

/// Uses poses, also after a rejected pose. In playback, throws the first error at the end.
void MappingSession::useWaiting(const std::vector<NoisyPose>& poses) {
  std::exception_ptr error;
  for (const NoisyPose& pose : poses) {
    try {
      usePose(pose);
    } catch (const std::invalid_argument&) {
      if (!guard_.countRejectedPose() && !error) error = std::current_exception();
    }
  }
  if (error) std::rethrow_exception(error);
}

/// Selects a source of poses, if there is none yet, and uses its waiting poses.
void MappingSession::useSelected() {
  std::vector<NoisyPose> poses;
  for (const StampedPose& pose : pose_source_.select()) poses.push_back({pose, std::nullopt});
  useWaiting(poses);
}

void MappingSession::noteMissing(int camera, const MissingEvents& missing) {
  constexpr double kEnoughS = 0.2;
  first_look_ends_ = true;
  if (missing.reason == DropReason::kOverload) chooseFromSoFar(kEnoughS);
  if (guard_.clockWentBack()) {
    guard_.hold([=] { guard_.noteMissing(camera, missing); });
    return;
  }
  guard_.noteMissing(camera, missing);
}

/// Returns whether the tracker jumped and all events before the jump have arrived.
bool MappingSession::segmentEnds() const {
  return guard_.jumped() && (finished_ || mapper_.eventsCompleteNs() >= guard_.beforeJumpNs());
}

/// Continues with the poses after a jump when all windows before it are mapped. Drops windows that
/// contain the jump. @return true if it continued.
bool MappingSession::beginSegment() {
  if (!segmentEnds()) return false;
  const std::int64_t begin_ns = guard_.afterJumpNs();
  mapper_.dropWindowsBefore(begin_ns, DropReason::kJump);
  fitIntoSegments(begin_ns);
  useWaiting(guard_.beginSegment());
  finishMapper();  // impossible in `finish` while poses were held
  return true;
}

/// Continues with the clock after a reset when the complete windows before it are mapped.
/// @return true if it continued.
bool MappingSession::beginClock() {
  if (!guard_.clockWentBack()) return false;
  restartMapper();
  for (const std::function<void()>& add : guard_.beginClock()) {  // may hold input again
    try {
      add();
    } catch (...) {  // the events are counted
    }
  }
  finishMapper();
  return true;
}

/// Maps with the new clock from now on, and keeps the map so far.
void MappingSession::restartMapper() {
  FusionMapper fresh(mapperOptions(options_));  // completed before its use: memory may run out
  for (const RigCamera& rig_camera : mapper_.rig().cameras) fresh.addCamera(rig_camera);
  if (depth_follower_) fresh.setPlanes(depth_follower_->planes());
  mapper_.dropAllWindows(DropReason::kClockReset);
  earlier_counts_ += mapper_.counts();
  mapper_ = std::move(fresh);
  segment_ = {};
  status_.events.reset();
  newest_begin_ns_.reset();
  noises_.clear();
  no_scene_since_ns_.reset();
  events_without_scene_ = 0;
  look_again_ns_ = kMinTimeNs;
}

/// Ends the mapper's input, after the poses behind a jump and the data behind a reset are in.
/// Before that, marks the events as complete if there is a jump.
void MappingSession::finishMapper() {
  if (!finished_ || guard_.clockWentBack()) return;
  if (!guard_.jumped()) return mapper_.finish();
  const auto cameras = static_cast<int>(mapper_.rig().cameras.size());
  for (int camera = 0; camera < cameras; ++camera) mapper_.setCompleteUntil(camera, kMaxTimeNs);
}

void MappingSession::finish() {
  finished_ = true;
  guard_.dropAllMissing(mapper_);
  std::exception_ptr error;
  try {
    useSelected();
  } catch (const std::invalid_argument&) {  // the other poses are used
    error = std::current_exception();
  }
  finishMapper();
  if (error) std::rethrow_exception(error);
}

/// Limits the wait of events and poses if no window can be mapped.
void MappingSession::limitWaits() {
  if (finished_) return;
  const auto needed_ns = guard_.limitWaits(mapper_, pose_source_, status_.events);
  if (!needed_ns) return;
  for (auto& [source, noises] : noises_) {
    noises.erase(noises.begin(), noises.lower_bound(*needed_ns));
  }
}

void MappingSession::limitHeld(double max_events) {
  const auto is_excess = [&] { return static_cast<double>(heldEvents()) > max_events; };
  if (is_excess() && chooseFromSoFar(0)) return;
  while (is_excess() && dropOldestWindow()) {
  }
  if (is_excess() && !nextWindow()) dropOlderHalf();
}

std::optional<Window> MappingSession::nextWindow() {
  if (!hasCameras() || options_.automatic.any()) return std::nullopt;
  return mapper_.nextWindow();
}

/// Drops the oldest window that could be mapped, if newer events fill another window.
/// @return true if it dropped a window.
bool MappingSession::dropOldestWindow() {
  const std::optional<Window> oldest = nextWindow();
  if (!oldest) return false;
  if (mapper_.eventsCompleteNs() < oldest->t1_ns + (oldest->t1_ns - oldest->t0_ns)) return false;
  mapper_.dropWindow(*oldest, DropReason::kOverload);
  return true;
}

void MappingSession::dropOlderHalf() {
  const std::int64_t oldest_ns = mapper_.oldestHeldNs();
  if (!status_.events || oldest_ns >= status_.events->last_ns) return;
  const std::int64_t held_ns = status_.events->last_ns - oldest_ns;
  const double rate =
      static_cast<double>(mapper_.heldEvents()) / (1e-9 * static_cast<double>(held_ns));
  const KeyframePolicyOptions& policy = options_.mapper.policy;
  const double needed = policy.policy == KeyframePolicyKind::kEvents
                            ? static_cast<double>(policy.window_events)
                            : rate * policy.window_s;
  const double queue_events = options_.live.queueEvents();
  const bool too_large =  // because of its own rate, not of other waiting events
      hasCameras() && !options_.automatic.any() && needed > queue_events &&
      static_cast<double>(mapper_.heldEvents()) > queue_events / 2;
  if (too_large && policy.policy != KeyframePolicyKind::kEvents && shortenWindows(rate)) return;
  mapper_.dropWindowsBefore(oldest_ns + held_ns / 2 + 1,
                            too_large ? DropReason::kTooLarge : DropReason::kOverload);
  constexpr double kNews = 1.2;  // factor after which a larger window is reported again
  if (!too_large || needed < kNews * reported_needed_) return;
  reported_needed_ = needed;
  const std::string why = fmt::format(
      "a window needs {:.0f} events, the queue holds {:.0f}: expected smaller windows ([keyframes] "
      "window_s, window_events), or a larger [live] max_queue_events and max_queue_mb",
      needed, queue_events);
  guard_.setTooLarge(why);
  throw std::invalid_argument(why);
}

void MappingSession::insertEarlier(const std::vector<CloudPoint>& points,
                                   const Rigid3& T_world_ref) {
  automatic_.voxel_size_m = options_.automatic.voxel_size_m = false;
  cloud_.insertFixed(points, T_world_ref);
}

bool MappingSession::dropFailedWindow() {
  return std::exchange(keyframe_lost_, false) || mapper_.dropFailedWindow();
}

std::optional<KeyframeDepthMap> MappingSession::next(DsiSink* sink, const ProcessorClock& clock,
                                                     const KeyframeStore& store) {
  keyframe_lost_ = false;
  if (!hasCameras()) beginClock();
  if (!hasCameras() || !chooseAutomatic()) {
    limitWaits();
    return std::nullopt;
  }
  StageTimer timer(status_.times, clock);
  const DepthPlanesOptions used = planes();
  std::optional<KeyframeDepthMap> keyframe = mapper_.next(sink, &timer);
  while (!keyframe && endPiece()) keyframe = mapper_.next(sink, &timer);
  if (!keyframe) limitWaits();
  if (!keyframe && finished_) leaveOutBad(quality_.keyframes());
  if (keyframe) {
    newest_planes_ = used;
    try {
      if (depth_follower_ && depth_follower_->follow(keyframe->map.depth)) {
        mapper_.setPlanes(depth_follower_->planes());
      }
      if (depth_follower_) lookAgain(keyframe->window);
      insert(*keyframe, store);
    } catch (...) {
      mapper_.loseKeyframe();
      keyframe_lost_ = true;
      throw;
    }
  } else if (finished_ && refinement_ && !std::exchange(all_refined_, true)) {
    refinement_->finish();
    applyPending();
  }
  if (!keyframe && refinement_) refinement_->throwFailure();
  return keyframe;
}

/// Inserts a keyframe into the cloud, refines it, and moves keyframes to their refined poses. Cloud
/// and refinement number keyframes alike: after an error neither has the keyframe.
void MappingSession::insert(KeyframeDepthMap& keyframe, const KeyframeStore& store) {
  const Rigid3 T_odom_ref = keyframe.T_world_ref;
  if (quality_.keyframes() > 0) leaveOutBad(quality_.keyframes() - 1);
  QualityStatistics judged = quality_;
  MapQuality quality;
  if (options_.checks) {
    judged.add(keyframe, facts_);
    quality = judged.quality(facts_, options_.mapper.keyframe.planes,
                             selectedCameras(mapper_.rig(), options_.mapper.cameras).size());
  }
  status_.silent_keyframes.resize(mapper_.rig().cameras.size());
  T_odom_ref_.push_back(T_odom_ref);
  try {
    std::vector<ViewPoint> points =
        options_.late_fusion ? lateFusionPoints(keyframe) : viewPoints(keyframe);
    if (store) store(keyframe, points);
    Rigid3 T_world_ref = refinement_ ? refinement_->predict(T_odom_ref) : T_odom_ref;
    {
      const SecondsScope scope(status_.times.real.map, status_.times.cpu.map);
      cloud_.insert(std::move(points), T_world_ref);
    }
    if (refinement_) T_world_ref = refinement_->add(keyframe, noiseAt(keyframe.window.t_ref_ns));
    keyframe.T_world_ref = T_world_ref;
  } catch (...) {
    if (cloud_.T_world_ref().size() == T_odom_ref_.size()) cloud_.removeNewest();
    T_odom_ref_.pop_back();
    throw;
  }
  std::swap(quality_, judged);
  std::swap(status_.quality, quality);
  for (const int camera : keyframe.silent_cameras) {
    ++status_.silent_keyframes[static_cast<std::size_t>(camera)];
  }
  // A motion of a small part of a voxel is not visible.
  constexpr double kVoxelFraction = 0.1;
  if (!refinement_) return;
  const SecondsScope scope(status_.times.real.map, status_.times.cpu.map);
  try {
    moveKeyframes(kVoxelFraction * options_.cloud.voxel_size_m);
  } catch (...) {
    refinement_->fail(std::current_exception());
  }
}

/// Leaves the keyframes below `end` out of the map whose quality is too low. The quality of a
/// keyframe is known when the next one is made.
void MappingSession::leaveOutBad(std::size_t end) {
  for (; num_judged_ < end; ++num_judged_) {
    if (quality_.rightShareOf(num_judged_) >= options_.min_keyframe_quality) continue;
    cloud_.removePoints(num_judged_);
    left_out_.insert(num_judged_);
  }
}

/// Moves keyframes in the cloud to their refined poses. If a background thread refines, only a few
/// keyframes are moved at a time, because the mapping continues.
void MappingSession::moveKeyframes(double tolerance_m) {
  constexpr std::size_t kMaxMoves = 16;
  cloud_.move(refinement_->takeMoved());
  const bool in_background = options_.refinement.background && tolerance_m > 0;
  cloud_.applyPending(tolerance_m, in_background ? kMaxMoves : RefinedCloud::kAll);
}

void MappingSession::applyPending() {
  if (!refinement_) return;
  const SecondsScope scope(status_.times.real.map, status_.times.cpu.map);
  moveKeyframes(0);
}

SessionStatus MappingSession::status() const {
  SessionStatus status = status_;
  status.held_events = heldEvents();
  status.counts = earlier_counts_;
  status.counts += mapper_.counts();
  status.live = guard_.status(status.rejected_events, status.counts, options_.mapper.cameras);
  status.pose_source = pose_source_.selected();
  status.other_poses = pose_source_.unused();
  status.rig = mapper_.rig();
  status.silent_keyframes.resize(status.rig.cameras.size());
  status.quality.left_out = left_out_.size();
  if (refinement_) {
    status.refinement = refinement_->state();
    status.times.real.refine = status.refinement->seconds;
    status.times.cpu.refine = status.refinement->cpu_seconds;
  }
  return status;
}

}  // namespace efm
