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
#include "plugin/session/recording_survey.h"

namespace efm {
namespace {

/// A new camera may appear within this time of the recording's first event.
constexpr std::int64_t kRigCompletesNs = kNanosecondsPerSecond;
/// In live operation, poses wait for events so long.
constexpr std::int64_t kMaxEventWaitNs = 600 * kNanosecondsPerSecond;
/// Stands for the tracker among the cameras.
constexpr int kTracker = -1;

/// What a survey refuses, the mapping refuses, too.
template <typename Add>
void survey(Add add) {
  try {
    add();
  } catch (const std::invalid_argument&) {
  }
}

void extend(std::optional<TimeSpan>& span, std::int64_t t_ns) {
  if (!span) span = TimeSpan{t_ns, t_ns};
  span->first_ns = std::min(span->first_ns, t_ns);
  span->last_ns = std::max(span->last_ns, t_ns);
}

/// The time may not be checked yet.
std::int64_t trajectoryTime(std::int64_t t_ns, std::int64_t time_offset_ns) {
  const auto within = [](std::int64_t t) { return std::clamp(t, -kEndOfTimeNs, kEndOfTimeNs); };
  return within(within(t_ns) + time_offset_ns);
}

/// How many keyframes the refinement may move.
std::size_t movableKeyframes(const EventFusionOptions& options) {
  if (!options.refinement.enabled) return 0;
  return options.live.enabled ? static_cast<std::size_t>(options.live.max_keyframes)
                              : RefinedCloud::kAll;
}

}  // namespace

MappingSession::MappingSession(const EventFusionOptions& options)
    : automatic_(options.automatic),
      options_(options),
      rig_(options),
      pose_source_(options.rig.pose_source),
      mapper_(mapperOptions(options)),
      cloud_(options.cloud, movableKeyframes(options)) {
  if (options.live.enabled) {
    status_.live.emplace();
    rig_.declare(mapper_);
  }
  if (options.automatic.any() && !options.live.enabled) {
    surveyor_ = std::make_unique<RecordingSurveyor>(options);
  }
  if (options.refinement.enabled) {
    refinement_ = std::make_unique<MapRefinement>(options.refinement);
  }
}

MappingSession::~MappingSession() = default;

void MappingSession::addEvents(EventPacket packet) {
  if (clock_reset_) {
    const std::size_t put_off = packet.events.size();
    later_.emplace_back(
        [this, packet = std::move(packet)]() mutable { addEvents(std::move(packet)); });
    later_events_ += put_off;
    return;
  }
  if (surveyor_) survey([&] { surveyor_->addEvents(packet); });
  const int camera = packet.camera;
  const std::size_t events = packet.events.size();
  std::vector<EventPacket> packets;
  try {
    const SecondsScope scope(status_.times.real.tables, status_.times.cpu.tables, processSeconds);
    packets = rig_.add(std::move(packet), mapper_);
  } catch (...) {
    status_.refused_events[camera] += events;
    throw;
  }
  // A refused packet takes no other one with it.
  std::exception_ptr refusal;
  for (EventPacket& ready : packets) {
    const int ready_camera = ready.camera;
    const std::uint64_t complete = mapper_.readEvents() + ready.events.size();
    std::optional<std::int64_t> older_ns;
    try {
      if (options_.live.enabled && mapper_.isOlder(ready_camera, ready.events)) {
        older_ns = trajectoryTime(ready.events.front().t_ns, ready.calibration.time_offset_ns);
      } else if (options_.live.enabled) {
        mapper_.dropLate(ready_camera, ready.events);
      }
      feed(std::move(ready));
    } catch (...) {  // it contradicts its camera, or no memory
      status_.refused_events[ready_camera] += complete - mapper_.readEvents();
      if (!refusal) refusal = std::current_exception();
      if (older_ns) noteOlder(ready_camera, *older_ns);
    }
  }
  if (refusal) std::rethrow_exception(refusal);
}

/// In live operation: where a camera, or the tracker, sends nothing but older data for a second of
/// its clock, that clock went back. Not where other cameras go on ahead of it: then it alone is
/// wrong, and what it sends is refused.
void MappingSession::noteOlder(int sensor, std::int64_t t_ns) {
  if (!options_.live.enabled) return;
  for (auto& [other, older] : older_) older.others_ns.erase(sensor);
  const Older& older = older_.try_emplace(sensor, Older{t_ns, {}}).first->second;
  const bool alone = sensor != kTracker &&
                     std::any_of(older.others_ns.begin(), older.others_ns.end(), [&](auto& other) {
                       return other.second - t_ns > kNanosecondsPerSecond;
                     });
  if (alone || t_ns - older.since_ns < kNanosecondsPerSecond) return;
  clock_reset_ = true;
  if (!rig_.isComplete()) beginClock();
}

/// Not before the poses after a jump, and the data after a reset, are in.
void MappingSession::finishMapper() {
  if (finished_ && !clock_reset_ && next_stretch_.empty()) mapper_.finish();
}

/// Goes on to the clock after a reset, once the complete windows before it are mapped.
/// @return whether it did.
bool MappingSession::beginClock() {
  if (!clock_reset_) return false;
  startAnew();
  std::vector<std::function<void()>> calls = std::exchange(later_, {});  // may put off others
  for (const std::function<void()>& call : calls) {
    try {
      call();
    } catch (...) {  // its events are counted
    }
  }
  finishMapper();
  return true;
}

/// The sensor's newest data are no older than those before.
void MappingSession::noteInTime(int sensor, std::int64_t t_ns) {
  older_.erase(sensor);
  if (sensor == kTracker) return;
  for (auto& [other, older] : older_) older.others_ns[sensor] = t_ns;
}

/// The clock went back: maps on it from now on, with the map so far.
void MappingSession::startAnew() {
  FusionMapper anew(mapperOptions(options_));  // complete before it is used: memory may fail
  for (const RigCamera& rig_camera : mapper_.rig().cameras) anew.addCamera(rig_camera);
  if (depth_follower_) anew.setPlanes(depth_follower_->planes());
  mapper_.giveUpAll(&WindowsGivenUp::clock_reset);
  earlier_counts_ += mapper_.counts();
  mapper_ = std::move(anew);
  clock_reset_ = false;
  later_events_ = 0;
  stretch_ = {};
  ++status_.live->clock_steps;
  status_.events.reset();
  newest_begin_ns_.reset();
  newest_pose_.reset();
  next_stretch_.clear();
  noises_.clear();
  older_.clear();
  missing_.clear();
  no_scene_since_ns_.reset();
  events_without_scene_ = 0;
  look_again_ns_ = kMinTimeNs;
}

void MappingSession::feed(EventPacket packet) {
  const RigCamera& camera = mapper_.rig().cameras[static_cast<std::size_t>(packet.camera)];
  if (!isSame(camera, packet.calibration)) {
    throw std::invalid_argument(
        fmt::format("camera {}: its calibration or its pose on the rig differs from that of its "
                    "first packet",
                    packet.camera));
  }
  const bool empty = packet.events.empty();
  const std::int64_t first_ns = empty ? 0 : packet.events.front().t_ns;
  const std::int64_t last_ns = empty ? 0 : packet.events.back().t_ns;
  {
    const SecondsScope scope(status_.times.real.filter, status_.times.cpu.filter);
    mapper_.addEvents(packet.camera, std::move(packet.events), packet.checked);
  }
  if (packet.covered_until_ns) mapper_.coverUntil(packet.camera, *packet.covered_until_ns);
  if (empty) {
    if (packet.covered_until_ns) {
      giveUpMissing(packet.camera, trajectoryTime(*packet.covered_until_ns, camera.time_offset_ns));
    }
    return;
  }
  giveUpMissing(packet.camera, std::max(first_ns, last_ns) + camera.time_offset_ns);
  const std::int64_t begin_ns = first_ns + camera.time_offset_ns;
  noteInTime(packet.camera, begin_ns);
  if (!status_.events && options_.live.enabled) stretch_.begin_ns = begin_ns;
  extend(status_.events, begin_ns);
  extend(status_.events, last_ns + camera.time_offset_ns);
  newest_begin_ns_ = std::max(newest_begin_ns_.value_or(begin_ns), begin_ns);
  giveUpOverdue();
  // Without a wait where neither another camera nor a better source of poses can come.
  const bool known = rig_.isKnown() && pose_source_.selected();
  if (known || seenFor(kRigCompletesNs) || fillsQueue()) completeRig();
}

/// Whether a packet began this long after the first event: by then every camera has sent one,
/// whatever the length of packets.
bool MappingSession::seenFor(std::int64_t duration_ns) const {
  return newest_begin_ns_ && *newest_begin_ns_ - status_.events->first_ns > duration_ns;
}

/// In live operation: whether as much waits as the events of a window may be, so that no further
/// camera is waited for.
bool MappingSession::fillsQueue() const {
  if (!options_.live.enabled || rig_.isComplete()) return false;
  std::uint64_t events = mapper_.heldEvents();
  for (const auto& [camera, waiting] : rig_.waitingEvents()) events += waiting;
  return static_cast<double>(events) > options_.live.queueEvents() / 2;
}

void MappingSession::completeRig() {
  if (rig_.isComplete()) return;
  rig_.requireOptionsFit();
  for (const StampedPose& pose : pose_source_.select()) useWaiting(pose, std::nullopt);
  rig_.complete();
}

void MappingSession::addPose(const StampedPose& pose, const PoseSourceId& source,
                             const std::optional<PoseNoise>& noise) {
  if (clock_reset_) {
    later_.emplace_back([=] {
      try {
        addPose(pose, source, noise);
      } catch (const std::invalid_argument&) {
        ++status_.live->refused_poses;
      }
    });
    return;
  }
  if (surveyor_) survey([&] { surveyor_->addPose(pose, source, {}); });
  const std::vector<StampedPose> poses = pose_source_.add(source, pose);
  try {
    usePoses(poses, noise);
  } catch (const std::invalid_argument&) {
    const bool is_old = newest_pose_ && pose.t_ns < newest_pose_->t_ns - kNanosecondsPerSecond;
    if (is_old) noteOlder(kTracker, pose.t_ns);
    throw;
  }
  if (!poses.empty()) noteInTime(kTracker, pose.t_ns);
  const bool used = !pose_source_.selected() || *pose_source_.selected() == source;
  // Of two poses of the same time the first counts, and so does its noise.
  if (refinement_ && used) noises_[source].try_emplace(pose.t_ns, noise);
}

/// The stated noise of the last pose up to a time. Forgets that of earlier poses.
std::optional<PoseNoise> MappingSession::noiseAt(std::int64_t t_ns) {
  if (!pose_source_.selected()) return std::nullopt;
  auto& noises = noises_[*pose_source_.selected()];
  const auto after = noises.upper_bound(t_ns);
  if (after == noises.begin()) return std::nullopt;
  noises.erase(noises.begin(), std::prev(after));
  return noises.begin()->second;
}

/// @param noise stated with the poses.
void MappingSession::usePoses(const std::vector<StampedPose>& poses,
                              const std::optional<PoseNoise>& noise) {
  for (const StampedPose& pose : poses) {
    if (options_.live.enabled &&
        (!next_stretch_.empty() || isJump(pose, noise.value_or(PoseNoise{})))) {
      next_stretch_.push_back({pose, noise});
      continue;
    }
    mapper_.addPose(pose);
    extend(status_.poses, pose.t_ns);
    if (!newest_pose_ || pose.t_ns >= newest_pose_->t_ns) newest_pose_ = pose;
  }
}

/// In live operation one that is refused takes no other one with it.
void MappingSession::useWaiting(const StampedPose& pose, const std::optional<PoseNoise>& noise) {
  try {
    usePoses({pose}, noise);
  } catch (const std::invalid_argument&) {
    if (!options_.live.enabled) throw;
    ++status_.live->refused_poses;
  }
}

/// Whether no motion explains a pose after the one before it.
bool MappingSession::isJump(const StampedPose& pose, const PoseNoise& noise) const {
  if (!newest_pose_ || pose.t_ns <= newest_pose_->t_ns) return false;
  constexpr double kSigmas = 5;
  const double dt_s = secondsBetween(newest_pose_->t_ns, pose.t_ns);
  const Rigid3 motion = newest_pose_->T_world_rig.inverse() * pose.T_world_rig;
  const double turn_rad = Eigen::AngleAxisd(motion.rotation).angle();
  return motion.translation.norm() > options_.live.max_speed_m_s * dt_s + kSigmas * noise.noise_m ||
         std::min(turn_rad, 2 * kPi - turn_rad) >
             options_.live.max_turn_deg_s * kRadiansPerDegree * dt_s + kSigmas * noise.noise_rad;
}

/// Whether the tracker jumped, and all events before the jump are here.
bool MappingSession::stretchEnds() const {
  if (next_stretch_.empty()) return false;
  return finished_ || mapper_.eventsCompleteNs() >= newest_pose_->t_ns;
}

/// Goes on to the poses after a jump, once all windows before it are mapped. Windows that span it
/// are given up. @return whether it did.
bool MappingSession::beginStretch() {
  if (!stretchEnds()) return false;
  ++status_.live->pose_jumps;
  mapper_.giveUpBefore(next_stretch_.front().first.t_ns, &WindowsGivenUp::jump);
  fitIntoStretches(next_stretch_.front().first.t_ns);
  newest_pose_.reset();
  for (const auto& [pose, noise] : std::exchange(next_stretch_, {})) useWaiting(pose, noise);
  finishMapper();
  return true;
}

/// Where no window can be mapped, neither events nor poses wait for the others without end: gives
/// up the windows whose poses are overdue, and takes overdue events for silence.
void MappingSession::limitWaits() {
  if (!options_.live.enabled || finished_) return;
  pose_source_.limitWaiting(kMaxEventWaitNs);
  std::optional<std::int64_t> newest_ns = pose_source_.waitingNs();
  if (newest_pose_) {
    newest_ns = next_stretch_.empty() ? newest_pose_->t_ns : next_stretch_.back().first.t_ns;
    mapper_.coverAllUntil(*newest_ns - kMaxEventWaitNs);
  }
  if (newest_ns) {
    const std::int64_t overdue_ns = std::max(*newest_ns, -kEndOfTimeNs) - kMaxEventWaitNs;
    for (auto& [source, noises] : noises_)
      noises.erase(noises.begin(), noises.lower_bound(overdue_ns));
    const auto in_time =
        std::find_if(next_stretch_.begin(), next_stretch_.end(),
                     [&](const auto& waiting) { return waiting.first.t_ns >= overdue_ns; });
    next_stretch_.erase(next_stretch_.begin(), in_time);
  }
  if (!status_.events) return;
  const std::int64_t overdue_ns =
      status_.events->last_ns - durationFromSeconds(options_.live.max_pose_wait_s);
  if (!newest_ns || *newest_ns < overdue_ns) {
    mapper_.giveUpBefore(overdue_ns, &WindowsGivenUp::no_pose);
  }
}

void MappingSession::skipEvents(const EventPacket& packet) {
  if (packet.events.empty()) return;
  status_.paused_events[packet.camera] += packet.events.size();
  noteMissing(packet.camera, {packet.events.back().t_ns + 1, &WindowsGivenUp::paused});
}

void MappingSession::noteMissing(int camera, const MissingEvents& missing) {
  if (clock_reset_) {
    later_.emplace_back([=] { noteMissing(camera, missing); });
    return;
  }
  MissingEvents& noted = missing_[camera];
  noted = {std::max(noted.until_ns, missing.until_ns), missing.reason};
}

/// Until when a camera lacks events, on the trajectory's clock. Nothing where it is not known yet.
std::optional<std::int64_t> MappingSession::missingUntil(int camera) const {
  const auto missing = missing_.find(camera);
  const auto index = static_cast<std::size_t>(camera);
  if (missing == missing_.end() || index >= mapper_.rig().cameras.size()) return std::nullopt;
  return trajectoryTime(missing->second.until_ns, mapper_.rig().cameras[index].time_offset_ns);
}

/// Gives up the windows that lack events of a camera.
/// @param next_ns no event before this time, on the trajectory's clock, is missing: the camera's
/// own next data begin earlier.
void MappingSession::giveUpMissing(int camera, std::int64_t next_ns) {
  const std::optional<std::int64_t> until_ns = missingUntil(camera);
  if (!until_ns) return;
  mapper_.giveUpBefore(std::min(*until_ns, next_ns), missing_.at(camera).reason);
  missing_.erase(camera);
}

/// A camera that lacks events may send nothing any more.
void MappingSession::giveUpOverdue() {
  const std::map<int, MissingEvents> missing = missing_;
  for (const auto& [camera, events] : missing) {
    const std::optional<std::int64_t> until_ns = missingUntil(camera);
    if (until_ns && *until_ns <= *newest_begin_ns_) giveUpMissing(camera, kMaxTimeNs);
  }
}

bool MappingSession::giveUpOldestWindow() {
  const std::optional<Window> oldest = nextWindow();
  if (!oldest) return false;
  if (mapper_.eventsCompleteNs() < oldest->t1_ns + (oldest->t1_ns - oldest->t0_ns)) return false;
  mapper_.giveUpWindow(*oldest, &WindowsGivenUp::overload);
  return true;
}

void MappingSession::giveUpOlderHalf() {
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
  const bool too_large =  // by its own rate, not by what waits elsewhere
      rig_.isComplete() && !options_.automatic.any() && needed > queue_events &&
      static_cast<double>(mapper_.heldEvents()) > queue_events / 2;
  if (too_large && policy.policy != KeyframePolicyKind::kEvents && shortenWindows(rate)) return;
  mapper_.giveUpBefore(oldest_ns + held_ns / 2 + 1,
                       too_large ? &WindowsGivenUp::too_large : &WindowsGivenUp::overload);
  constexpr double kNews = 1.2;  // one that is that much larger is told again
  if (!too_large || needed < kNews * told_needed_) return;
  told_needed_ = needed;
  status_.live->too_large = fmt::format(
      "a window needs {:.0f} events, the queue holds {:.0f}: expected smaller windows ([keyframes] "
      "window_s, window_events), or a larger [live] max_queue_events and max_queue_mb",
      needed, queue_events);
  throw std::invalid_argument(status_.live->too_large);
}

bool MappingSession::giveUpFailed() {
  return std::exchange(keyframe_lost_, false) || mapper_.giveUpFailed();
}

std::optional<Window> MappingSession::nextWindow() {
  if (!rig_.isComplete() || options_.automatic.any()) return std::nullopt;
  return mapper_.nextWindow();
}

void MappingSession::insertEarlier(const std::vector<CloudPoint>& points,
                                   const Rigid3& T_world_ref) {
  cloud_.insertFixed(points, T_world_ref);
}

void MappingSession::finish() {
  finished_ = true;
  while (!missing_.empty()) {
    const int camera = missing_.begin()->first;
    giveUpMissing(camera, kMaxTimeNs);
    missing_.erase(camera);
  }
  for (const auto& [camera, events] : rig_.waitingEvents()) {
    status_.refused_events[camera] += events;
  }
  for (const StampedPose& pose : pose_source_.select()) useWaiting(pose, std::nullopt);
  finishMapper();
  completeRig();
  rig_.requireNoneWaits();
}

std::optional<KeyframeDepthMap> MappingSession::next(DsiSink* sink, const ProcessorClock& clock,
                                                     const KeyframeStore& store) {
  keyframe_lost_ = false;
  if (!rig_.isComplete() || !chooseAutomatic()) {
    limitWaits();
    return std::nullopt;
  }
  StageTimer timer(status_.times, clock);
  std::optional<KeyframeDepthMap> keyframe = mapper_.next(sink, &timer);
  while (!keyframe && endPiece()) keyframe = mapper_.next(sink, &timer);
  if (!keyframe) limitWaits();
  if (keyframe) {
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

std::optional<WindowData> MappingSession::window() {
  return rig_.isComplete() ? mapper_.window() : std::nullopt;
}

/// Inserts a keyframe into the cloud, refines it, and moves it and others to their refined poses.
/// Cloud and refinement number keyframes alike: after an error neither has the keyframe.
void MappingSession::insert(KeyframeDepthMap& keyframe, const KeyframeStore& store) {
  const Rigid3 T_odom_ref = keyframe.T_world_ref;
  status_.silent_keyframes.resize(mapper_.rig().cameras.size());
  T_odom_ref_.push_back(T_odom_ref);
  try {
    if (store) store(keyframe);
    Rigid3 T_world_ref = refinement_ ? refinement_->predict(T_odom_ref) : T_odom_ref;
    {
      const SecondsScope scope(status_.times.real.map, status_.times.cpu.map);
      cloud_.insert(pointsOf(keyframe), T_world_ref);
    }
    if (refinement_) T_world_ref = refinement_->add(keyframe, noiseAt(keyframe.window.t_ref_ns));
    keyframe.T_world_ref = T_world_ref;
  } catch (...) {
    if (cloud_.T_world_ref().size() == T_odom_ref_.size()) cloud_.removeNewest();
    T_odom_ref_.pop_back();
    throw;
  }
  for (const int camera : keyframe.silent_cameras) {
    ++status_.silent_keyframes[static_cast<std::size_t>(camera)];
  }
  // Nobody sees a motion of a small part of a voxel.
  constexpr double kVoxelFraction = 0.1;
  if (!refinement_) return;
  const SecondsScope scope(status_.times.real.map, status_.times.cpu.map);
  try {
    moveKeyframes(kVoxelFraction * options_.cloud.voxel_size_m);
  } catch (...) {
    refinement_->fail(std::current_exception());
  }
}

/// Moves keyframes in the cloud to their refined poses; in live operation a few at a time, because
/// the mapping goes on.
void MappingSession::moveKeyframes(double tolerance_m) {
  constexpr std::size_t kMaxMovesWhenLive = 16;
  cloud_.move(refinement_->takeMoved());
  const bool live = options_.refinement.background && tolerance_m > 0;
  cloud_.applyPending(tolerance_m,
                      live ? kMaxMovesWhenLive : std::numeric_limits<std::size_t>::max());
}

void MappingSession::applyPending() {
  if (!refinement_) return;
  const SecondsScope scope(status_.times.real.map, status_.times.cpu.map);
  moveKeyframes(0);
}

std::vector<ViewPoint> MappingSession::pointsOf(const KeyframeDepthMap& keyframe) const {
  return options_.late_fusion ? lateFusionPoints(keyframe) : viewPoints(keyframe);
}

SessionStatus MappingSession::status() const {
  SessionStatus status = status_;
  status.counts = earlier_counts_;
  status.counts += mapper_.counts();
  status.pose_source = pose_source_.selected();
  status.other_poses = pose_source_.unused();
  status.rig = mapper_.rig();
  status.silent_keyframes.resize(status.rig.cameras.size());
  if (status.live) {
    for (const auto& [camera, events] : status.refused_events) {
      status.live->cameras[camera].lost += events;
    }
    for (std::size_t c = 0; c < status.counts.cameras.size(); ++c) {
      const auto camera = static_cast<int>(c);
      if (!isSelected(camera, options_.mapper.cameras)) continue;
      const EventCounts& counts = status.counts.cameras[c];
      status.live->cameras[camera].lost += counts.dropped + counts.without_pose;
    }
  }
  status.recalibrated_cameras = rig_.recalibratedCameras();
  if (refinement_) {
    status.refinement = refinement_->state();
    status.times.real.refine = status.refinement->seconds;
    status.times.cpu.refine = status.refinement->cpu_seconds;
  }
  return status;
}

}  // namespace efm
