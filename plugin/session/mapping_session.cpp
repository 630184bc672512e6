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

MappingSession::MappingSession(const EventFusionOptions& options,
                               const std::vector<StoredKeyframe>& earlier, QualityFacts facts,
                               ChoiceBy choice_by)
    : automatic_(options.automatic),
      options_(options),
      pose_source_(options.rig.pose_source),
      store_(mapperOptions(options)),
      waits_for_options_(choice_by == ChoiceBy::kCaller && options.automatic.any()),
      cloud_(options.cloud, options.movableKeyframes()),
      facts_(std::move(facts)) {
  if (options.refinement.enabled) {
    refinement_ = std::make_unique<MapRefinement>(options.refinement);
  }
  for (const StoredKeyframe& keyframe : earlier) {
    automatic_.voxel_size_m = options_.automatic.voxel_size_m = false;
    cloud_.insertFixed(pointsInWorld(*keyframe.points, keyframe.T_world_ref), keyframe.T_world_ref);
    keep(keyframe);
  }
  forgetOldest();
}

void MappingSession::addCameras(const Rig& rig) {
  const StageScope scope(&status_.times, &StageSeconds::tables);
  for (const RigCamera& camera : rig.cameras) store_.mapper.addCamera(camera);
}

void MappingSession::add(Input input) {
  endPiece();  // complete windows before the break are mapped
  if (const auto* rig = std::get_if<Rig>(&input)) addCameras(*rig);
  if (auto* packet = std::get_if<EventPacket>(&input)) addEvents(std::move(*packet));
  if (const auto* pose = std::get_if<PoseSample>(&input)) addPose(*pose);
  if (const auto* missing = std::get_if<Missing>(&input)) noteMissing(*missing);
  if (auto* chosen = std::get_if<NewOptions>(&input)) use(std::move(*chosen));
  if (std::holds_alternative<ClockReset>(input)) break_ = ClockReset{};
  const auto* const jump = std::get_if<Jump>(&input);
  if (!jump) return;
  useSelected();
  if (pose_source_.selected() == jump->source) break_ = *jump;
}

void MappingSession::addEvents(EventPacket packet) {
  const int camera = packet.camera;
  const std::uint64_t complete = store_.mapper.readEvents() + packet.events.size();
  try {
    feed(std::move(packet));
  } catch (...) {  // contradicts its camera, or no memory
    status_.rejected_events[camera] += complete - store_.mapper.readEvents();
    throw;
  }
}

void MappingSession::feed(EventPacket packet) {
  const std::int64_t offset_ns =
      store_.mapper.rig().cameras.at(static_cast<std::size_t>(packet.camera)).time_offset_ns;
  const bool empty = packet.events.empty();
  const std::int64_t first_ns = empty ? 0 : packet.events.front().t_ns;
  const std::int64_t last_ns = empty ? 0 : packet.events.back().t_ns;
  {
    const StageScope scope(&status_.times, &StageSeconds::filter, Processors::kThis);
    store_.mapper.addEvents(packet.camera, std::move(packet.events));
  }
  if (packet.complete_until_ns) {
    store_.mapper.setCompleteUntil(packet.camera, *packet.complete_until_ns);
  }
  if (empty) {
    if (!packet.complete_until_ns) return;
    dropMissing(packet.camera, trajectoryTime(*packet.complete_until_ns, offset_ns));
    return;
  }
  dropMissing(packet.camera, std::max(first_ns, last_ns) + offset_ns);
  const std::int64_t begin_ns = first_ns + offset_ns;
  if (!store_.events) store_.segment.begin_ns = begin_ns;
  extend(store_.events, begin_ns);
  extend(store_.events, last_ns + offset_ns);
  store_.newest_begin_ns = std::max(store_.newest_begin_ns.value_or(begin_ns), begin_ns);
  dropOverdue(*store_.newest_begin_ns);
  if (*store_.newest_begin_ns - store_.events->first_ns > kMaxSourceWaitNs) useSelected();
}

void MappingSession::addPose(const PoseSample& sample) {
  const PoseSourceId& source = sample.source;
  const std::string error = usePoses(pose_source_.add(source, {sample.t_ns, sample.T_world_rig()}));
  if (!error.empty()) throw std::invalid_argument(error);
  const bool used = !pose_source_.selected() || *pose_source_.selected() == source;
  // If two poses have the same time, the first one is used, and so is its noise.
  if (used) store_.noises[source].try_emplace(sample.t_ns, sample.noise);
}

/// Returns the stated noise of the last pose up to a time. Forgets the noise of earlier poses.
std::optional<PoseNoise> MappingSession::noiseAt(std::int64_t t_ns) {
  if (!pose_source_.selected()) return std::nullopt;
  auto& noises = store_.noises[*pose_source_.selected()];
  const auto after = noises.upper_bound(t_ns);
  if (after == noises.begin()) return std::nullopt;
  noises.erase(noises.begin(), std::prev(after));
  return noises.begin()->second;
}

/// Uses poses, also after a rejected one. @return why the first one was rejected; empty: none was.
std::string MappingSession::usePoses(const std::vector<StampedPose>& poses) {
  std::string error;
  for (const StampedPose& pose : poses) {
    try {
      store_.mapper.addPose(pose);
      extend(status_.poses, pose.t_ns);
      store_.newest_pose_ns = std::max(store_.newest_pose_ns.value_or(pose.t_ns), pose.t_ns);
    } catch (const std::invalid_argument& rejected) {
      ++live_.rejected_poses;
      if (error.empty()) error = rejected.what();
    }
  }
  return error;
}

/// Selects a source of poses, if there is none yet, and uses its waiting poses. `finish` throws
/// their first error.
void MappingSession::useSelected() {
  const std::string error = usePoses(pose_source_.select());
  if (waiting_error_.empty()) waiting_error_ = error;
}

void MappingSession::noteMissing(const Missing& missing) {
  constexpr double kEnoughS = 0.2;
  if (missing.reason == DropReason::kOverload) chooseFromSoFar(kEnoughS);
  Missing& noted = store_.missing.try_emplace(missing.camera, missing).first->second;
  noted.until_ns = std::max(noted.until_ns, missing.until_ns);
  noted.reason = missing.reason;
}

/// Returns the end of what is missing, on the clock of the poses; std::nullopt if nothing is.
std::optional<std::int64_t> MappingSession::missingUntil(int camera) const {
  const auto missing = store_.missing.find(camera);
  const auto index = static_cast<std::size_t>(camera);
  const std::vector<RigCamera>& cameras = store_.mapper.rig().cameras;
  if (missing == store_.missing.end() || index >= cameras.size()) return std::nullopt;
  return trajectoryTime(missing->second.until_ns, cameras[index].time_offset_ns);
}

/// Drops the windows that need missing events of a camera.
/// @param next_ns the camera's next data begin here at the latest. No event is missing after it.
void MappingSession::dropMissing(int camera, std::int64_t next_ns) {
  const std::optional<std::int64_t> until_ns = missingUntil(camera);
  if (!until_ns) return;
  store_.mapper.dropWindowsBefore(std::min(*until_ns, next_ns), store_.missing.at(camera).reason);
  store_.missing.erase(camera);
}

/// Drops the windows that need missing events of cameras that send nothing any more.
/// @param newest_begin_ns begin of the newest packet of any camera.
void MappingSession::dropOverdue(std::int64_t newest_begin_ns) {
  const std::map<int, Missing> missing = store_.missing;
  for (const auto& [camera, events] : missing) {
    const std::optional<std::int64_t> until_ns = missingUntil(camera);
    if (until_ns && *until_ns <= newest_begin_ns) dropMissing(camera, kMaxTimeNs);
  }
}

/// Goes on behind a break of the input, if there is one. The complete windows before it must have
/// been mapped. @return whether there was one.
bool MappingSession::endPiece() {
  if (!break_) return false;
  if (const auto* jump = std::get_if<Jump>(&*break_)) {
    store_.mapper.dropWindowsBefore(jump->after_ns, DropReason::kJump);
    fitIntoSegments(jump->after_ns);
    ++live_.pose_jumps;
  } else {
    restartMapper();
    ++live_.clock_resets;
  }
  break_.reset();
  return true;
}

/// Maps with the new clock from now on, and keeps the map so far.
void MappingSession::restartMapper() {
  EventStore fresh(mapperOptions(options_));  // completed before its use: memory may run out
  for (const RigCamera& camera : store_.mapper.rig().cameras) fresh.mapper.addCamera(camera);
  if (depth_follower_) fresh.mapper.setPlanes(depth_follower_->planes());
  store_.mapper.dropAllWindows(DropReason::kClockReset);
  earlier_counts_ += store_.mapper.counts();
  store_ = std::move(fresh);
  pose_source_.forgetWaiting();
}

void MappingSession::finish() {
  endPiece();
  finished_ = true;
  dropOverdue(kMaxTimeNs);
  store_.missing.clear();
  store_.mapper.finish();
  useSelected();
  if (!waiting_error_.empty()) throw std::invalid_argument(std::exchange(waiting_error_, {}));
}

void MappingSession::limitWaits() {
  constexpr std::int64_t kMaxEventWaitNs = 600 * kNanosecondsPerSecond;
  if (finished_) return;
  pose_source_.limitWaiting(kMaxEventWaitNs);
  std::optional<std::int64_t> newest_ns = pose_source_.waitingNs();
  if (store_.newest_pose_ns) {
    newest_ns = *store_.newest_pose_ns;
    store_.mapper.setAllCompleteUntil(*newest_ns - kMaxEventWaitNs);
  }
  if (newest_ns) {
    const std::int64_t needed_ns = std::max(*newest_ns, -kEndOfTimeNs) - kMaxEventWaitNs;
    for (auto& [source, noises] : store_.noises) {
      noises.erase(noises.begin(), noises.lower_bound(needed_ns));
    }
  }
  if (!store_.events) return;
  const std::int64_t overdue_ns =
      store_.events->last_ns - durationFromSeconds(options_.live.max_pose_wait_s);
  if (!newest_ns || *newest_ns < overdue_ns) {
    store_.mapper.dropWindowsBefore(overdue_ns, DropReason::kNoPose);
  }
}

void MappingSession::limitHeld(double max_events) {
  const auto held = [&] { return static_cast<double>(store_.mapper.heldEvents()); };
  const auto is_excess = [&] { return held() > max_events; };
  constexpr double kEnoughS = 0.001;
  if (held() > options_.live.queueEvents() / 2) useSelected();
  if (is_excess() && chooseFromSoFar(kEnoughS)) return;
  while (is_excess() && dropOldestWindow()) {
  }
  if (is_excess() && !nextWindow()) dropOlderHalf();
}

std::optional<Window> MappingSession::nextWindow() {
  if (!hasCameras() || options_.automatic.any()) return std::nullopt;
  return store_.mapper.nextWindow();
}

/// Drops the oldest window that could be mapped, if newer events fill another window.
/// @return true if it dropped a window.
bool MappingSession::dropOldestWindow() {
  const std::optional<Window> oldest = nextWindow();
  if (!oldest) return false;
  if (eventsCompleteNs() < oldest->t1_ns + (oldest->t1_ns - oldest->t0_ns)) return false;
  store_.mapper.dropWindow(*oldest, DropReason::kOverload);
  return true;
}

void MappingSession::dropOlderHalf() {
  const std::int64_t oldest_ns = store_.mapper.oldestHeldNs();
  if (!store_.events || oldest_ns >= store_.events->last_ns) return;
  const std::int64_t held_ns = store_.events->last_ns - oldest_ns;
  const double rate =
      static_cast<double>(store_.mapper.heldEvents()) / (1e-9 * static_cast<double>(held_ns));
  const KeyframePolicyOptions& policy = options_.mapper.policy;
  const double needed = policy.policy == KeyframePolicyKind::kEvents
                            ? static_cast<double>(policy.window_events)
                            : rate * policy.window_s;
  const double queue_events = options_.live.queueEvents();
  const bool too_large =  // because of its own rate, not of other waiting events
      hasCameras() && !options_.automatic.any() && needed > queue_events &&
      static_cast<double>(store_.mapper.heldEvents()) > queue_events / 2;
  if (too_large && policy.policy != KeyframePolicyKind::kEvents && shortenWindows(rate)) return;
  store_.mapper.dropWindowsBefore(oldest_ns + held_ns / 2 + 1,
                                  too_large ? DropReason::kTooLarge : DropReason::kOverload);
  constexpr double kNews = 1.2;  // factor after which a larger window is reported again
  if (!too_large || needed < kNews * reported_needed_) return;
  reported_needed_ = needed;
  const std::string why = fmt::format(
      "a window needs {:.0f} events, the queue holds {:.0f}: expected smaller windows ([keyframes] "
      "window_s, window_events), or a larger [live] max_queue_events and max_queue_mb",
      needed, queue_events);
  live_.too_large = why;
  throw std::invalid_argument(why);
}

bool MappingSession::dropFailedWindow() {
  return std::exchange(keyframe_lost_, false) || store_.mapper.dropFailedWindow();
}

std::optional<KeyframeDepthMap> MappingSession::next(DsiSink* sink) {
  keyframe_lost_ = false;
  if (!hasCameras() || !chooseAutomatic()) return std::nullopt;
  std::optional<KeyframeDepthMap> keyframe = store_.mapper.next(sink, &status_.times);
  while (!keyframe && endPiece()) keyframe = store_.mapper.next(sink, &status_.times);
  if (!keyframe && finished_) {
    leaveOutBad(quality_.keyframes());
    map_quality_ = {};  // to be judged once more, of all keyframes
  }
  if (keyframe) {
    try {
      if (depth_follower_ && depth_follower_->follow(keyframe->map.depth)) {
        store_.mapper.setPlanes(depth_follower_->planes());
      }
      if (depth_follower_) lookAgain(keyframe->window);
      insert(*keyframe);
    } catch (...) {
      store_.mapper.loseKeyframe();
      keyframe_lost_ = true;
      throw;
    }
  } else if (finished_ && refinement_ && !std::exchange(all_refined_, true)) {
    refinement_->finish();
    moveKeyframes(0);
  }
  if (!keyframe && refinement_) refinement_->throwFailure();
  return keyframe;
}

/// Inserts a keyframe into the cloud, refines it, and moves keyframes to their refined poses. Map,
/// cloud and refinement number keyframes alike: after an error none has the keyframe.
void MappingSession::insert(KeyframeDepthMap& keyframe) {
  const Rigid3 T_odom_ref = keyframe.T_odom_ref;
  keyframe.pose_noise = noiseAt(keyframe.window.t_ref_ns);
  if (quality_.keyframes() > 0) leaveOutBad(quality_.keyframes() - 1);
  std::optional<QualityStatistics::Judged> judged;
  if (options_.checks) judged = quality_.judge(keyframe, facts_);
  status_.silent_keyframes.resize(store_.mapper.rig().cameras.size());
  const std::size_t kept = map_.trajectory.size();
  const std::size_t kept_keyframes = map_.keyframes.size();
  const std::size_t inserted = cloud_.T_world_ref().size();
  try {
    std::vector<ViewPoint> points =
        options_.late_fusion ? lateFusionPoints(keyframe) : viewPoints(keyframe);
    keep({keyframe.window.t_ref_ns, T_odom_ref,
          std::make_shared<const std::vector<ViewPoint>>(points)});
    Rigid3 T_world_ref = refinement_ ? refinement_->predict(T_odom_ref) : T_odom_ref;
    {
      const StageScope scope(&status_.times, &StageSeconds::map, Processors::kThis);
      cloud_.insert(std::move(points), T_world_ref);
    }
    if (refinement_) T_world_ref = refinement_->add(keyframe, keyframe.pose_noise);
    keyframe.T_world_ref = T_world_ref;
  } catch (...) {
    if (cloud_.T_world_ref().size() > inserted) cloud_.removeNewest();
    map_.trajectory.resize(kept);
    map_.tracker_trajectory.resize(std::min(map_.tracker_trajectory.size(), kept));
    map_.keyframes.resize(std::min(map_.keyframes.size(), kept_keyframes));
    throw;
  }
  if (judged) quality_.add(std::move(*judged));
  for (const int camera : keyframe.silent_cameras) {
    ++status_.silent_keyframes[static_cast<std::size_t>(camera)];
  }
  forgetOldest();
  // A motion of a small part of a voxel is not visible.
  constexpr double kVoxelFraction = 0.1;
  if (!refinement_) return;
  try {
    moveKeyframes(kVoxelFraction * options_.cloud.voxel_size_m);
  } catch (...) {
    refinement_->fail(std::current_exception());
  }
}

/// Adds a keyframe to the map. If memory runs out, the caller removes what was added.
void MappingSession::keep(StoredKeyframe keyframe) {
  const StampedPose pose{keyframe.t_ref_ns, keyframe.T_world_ref};
  map_.trajectory.push_back(pose);
  map_.tracker_trajectory.push_back(pose);
  map_.keyframes.push_back(std::move(keyframe));
}

/// In live operation, forgets the points of the oldest keyframes if there are too many.
void MappingSession::forgetOldest() {
  const std::size_t most = options_.keptKeyframes();
  if (map_.keyframes.size() <= most) return;
  map_.keyframes.erase(map_.keyframes.begin(),
                       map_.keyframes.end() - static_cast<std::ptrdiff_t>(most));
}

/// Leaves the keyframes below `end` out of the map whose quality is too low. The quality of a
/// keyframe is known when the next one is made.
void MappingSession::leaveOutBad(std::size_t end) {
  for (const std::size_t bad : quality_.takeBad(end, options_.min_keyframe_quality)) {
    cloud_.removePoints(bad);
    left_out_.insert(bad);
  }
}

/// Moves keyframes in the cloud to their refined poses. If a background thread refines, only a few
/// keyframes are moved at a time, because the mapping continues.
void MappingSession::moveKeyframes(double tolerance_m) {
  constexpr std::size_t kMaxMoves = 16;
  const StageScope scope(&status_.times, &StageSeconds::map, Processors::kThis);
  cloud_.move(refinement_->takeMoved());
  const bool in_background = options_.refinement.background && tolerance_m > 0;
  cloud_.applyPending(tolerance_m, in_background ? kMaxMoves : RefinedCloud::kAll);
}

std::shared_ptr<MapSnapshot> MappingSession::snapshot(bool with_points) {
  if (refinement_) moveKeyframes(0);  // so that cloud and keyframes agree
  const std::vector<Rigid3>& T_world_ref = cloud_.T_world_ref();
  const std::size_t earlier = map_.trajectory.size() - T_world_ref.size();
  const std::size_t forgotten = map_.trajectory.size() - map_.keyframes.size();
  for (std::size_t i = earlier; i < map_.trajectory.size(); ++i) {
    Rigid3& known = map_.trajectory[i].T_world_rig;
    if (isSame(known, T_world_ref[i - earlier])) continue;
    known = T_world_ref[i - earlier];
    if (i >= forgotten) map_.keyframes[i - forgotten].T_world_ref = known;
  }
  for (const std::size_t left_out : left_out_) {
    if (earlier + left_out < forgotten) continue;
    map_.keyframes[earlier + left_out - forgotten].points =
        std::make_shared<const std::vector<ViewPoint>>();
  }
  auto map = std::make_shared<MapSnapshot>(map_);
  if (with_points) map->points = cloud_.cloud().points();
  return map;
}

/// Judges the keyframes again after each twentieth of them: otherwise the cost of a status would
/// grow with their number.
const MapQuality& MappingSession::mapQuality() const {
  constexpr std::size_t kParts = 20;
  const std::size_t judged = map_quality_.keyframes.size();
  const std::size_t waiting = quality_.keyframes() - judged;
  if (waiting > judged / kParts) {
    map_quality_ =
        quality_.quality(facts_, options_.mapper.keyframe.planes,
                         selectedCameras(store_.mapper.rig(), options_.mapper.cameras).size());
  }
  return map_quality_;
}

SessionStatus MappingSession::status() const {
  SessionStatus status = status_;
  status.quality = mapQuality();
  status.held_events = store_.mapper.heldEvents();
  status.events = store_.events;
  status.counts = earlier_counts_;
  status.counts += store_.mapper.counts();
  LiveStatus& live = status.live.emplace(live_);
  for (const auto& [camera, events] : status.rejected_events) live.cameras[camera].lost += events;
  for (std::size_t c = 0; c < status.counts.cameras.size(); ++c) {
    live.cameras[static_cast<int>(c)].lost += status.counts.cameras[c].fates.losses();
  }
  status.pose_source = pose_source_.selected();
  status.other_poses = pose_source_.unused();
  status.rig = store_.mapper.rig();
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
