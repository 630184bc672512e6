// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/keyframes/fusion_mapper.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <stdexcept>
#include <string>
#include <utility>

#include "mapping/base/option.h"
#include "mapping/base/thread_arena.h"
#include "mapping/geometry/timestamp.h"

namespace efm {
namespace {

/// A camera is silent if its newest event is this much older than the newest packet.
constexpr std::int64_t kMaxCameraLagNs = kNanosecondsPerSecond;
/// A pose may be older than the newest pose by this duration.
constexpr std::int64_t kMaxPoseDelayNs = kNanosecondsPerSecond;

/// Returns the assumed mean depth of the scene before the first keyframe: the middle plane of
/// inverse spacing, which is the harmonic mean of the limits.
double depthGuess(const DepthPlanesOptions& planes) {
  return 2.0 / (1.0 / planes.min_depth_m + 1.0 / planes.max_depth_m);
}

}  // namespace

TimeLimits FusionMapperOptions::interval() const {
  if (only_window) return {only_window->t0_ns, only_window->t1_ns};
  if (planned_windows.empty()) return limits;
  const std::int64_t t0_ns = planned_windows.front().t0_ns - filter.memoryNs();
  return {std::max(t0_ns, limits.t0_ns.value_or(kMinTimeNs)), planned_windows.back().t1_ns};
}

void FusionMapperOptions::validate() const {
  trajectory.validate();
  policy.validate();
  keyframe.validate();
  limits.validate();
  filter.validate();
  for (auto camera = cameras.begin(); camera != cameras.end(); ++camera) {
    requireOption(*camera >= 0, "cameras", *camera, "0 or above");
    requireOption(std::find(cameras.begin(), camera, *camera) == camera, "cameras", *camera,
                  "there once");
  }
  if (only_window && !(only_window->t0_ns < only_window->t1_ns)) {
    throw std::invalid_argument("the window from " + formatSeconds(only_window->t0_ns) + " s to " +
                                formatSeconds(only_window->t1_ns) + " s: must end after it begins");
  }
}

FusionMapper::FusionMapper(const FusionMapperOptions& options)
    : options_(options), trajectory_(options.trajectory) {
  options_.validate();
  std::vector<Window> given = options_.givenWindows();
  if (!given.empty()) given_ns_ = given.front().t0_ns;
  policy_ = given_ns_ ? makeGivenWindowsPolicy(std::move(given))
                      : makeKeyframePolicy(options_.policy, depthGuess(options_.keyframe.planes));
}

int FusionMapper::addCamera(const RigCamera& camera) {
  if (mapper_) throw std::logic_error("a camera was added after the first keyframe");
  camera.validate();
  const auto index = static_cast<int>(rig_.cameras.size());
  const bool takes_part = isSelected(index, options_.cameras);
  std::vector<bool> outside_lens;
  if (takes_part) {
    ThreadArena arena(options_.keyframe.sweep.threadsOrCores());
    arena.execute([&] { undistortion_.emplace_back(camera.model); });
    outside_lens = undistortion_.back().outsideLens();
  }
  rig_.cameras.push_back(camera);
  cameras_.emplace_back(index, camera, takes_part, std::move(outside_lens), options_.filter);
  return index;
}

void FusionMapper::addPose(const StampedPose& pose) {
  if (!trajectory_.empty()) {
    const std::int64_t newest_ns = trajectory_.poses().back().t_ns;
    if (pose.t_ns < newest_ns - kMaxPoseDelayNs) {
      throw std::invalid_argument("the pose at " + formatSeconds(pose.t_ns) +
                                  " s comes after one at " + formatSeconds(newest_ns) +
                                  " s: poses must come in time order, up to a second");
    }
  }
  if (!trajectory_.add(pose)) ++counts_.duplicate_poses;
}

void FusionMapper::addEvents(int camera, CheckedEvents events) {
  CameraStream& stream = cameras_.at(static_cast<std::size_t>(camera));
  if (events.empty()) return;
  stream.requireNext(events);
  const std::int64_t begin_ns = stream.onTrajectoryClock(events.front().t_ns);
  // The beginning of packets is compared: during a long packet of another camera, this camera need
  // not have delivered yet.
  packet_ns_ = std::max(packet_ns_.value_or(begin_ns), begin_ns);
  counts_.sorted_events += stream.add(std::move(events).take(), options_.limits, released_ns_);
  if (heldEvents() >= options_.max_waiting_events) silent_ns_ = *packet_ns_ - kMaxCameraLagNs;
  const std::int64_t newest_ns = *stream.newestNs();
  reached_ns_ = std::max(reached_ns_.value_or(newest_ns), newest_ns);
}

void FusionMapper::setAllCompleteUntil(std::int64_t t_ns) {
  for (CameraStream& camera : cameras_) camera.setCompleteUntil(t_ns - camera.onTrajectoryClock(0));
  if (!start_ns_) dropWindowsBefore(t_ns, DropReason::kNoPose);
}

std::optional<KeyframeDepthMap> FusionMapper::next(DsiSink* sink, StageTimes* times) {
  failed_.reset();
  {
    const StageScope scope(times, &StageSeconds::filter, Processors::kThis);
    filterEvents();
  }
  while (const std::optional<Window> window = completeWindow()) {
    failed_ = window;
    std::optional<KeyframeDepthMap> keyframe = mapWindow(*window, sink, times);
    failed_.reset();
    policy_->advance(*window, keyframe ? &*keyframe : nullptr);
    releaseBefore(releasableUntil());
    if (keyframe) return keyframe;
  }
  if (finished_) {
    releaseBefore(kMaxTimeNs);
  } else if (start_ns_) {
    releaseBefore(releasableUntil());
  }
  return std::nullopt;
}

std::optional<Window> FusionMapper::nextWindow() {
  filterEvents();
  return completeWindow();
}

std::optional<WindowData> FusionMapper::window() {
  const std::optional<Window> window = nextWindow();
  if (!window) return finished_ ? rest() : std::nullopt;
  return WindowData{*window, eventsOf(*window), &trajectory_};
}

std::optional<WindowData> FusionMapper::rest() const {
  if (!start_ns_) return std::nullopt;
  const std::int64_t t0_ns = policy_->earliestStart(*this);
  const std::int64_t t1_ns = std::min(completeNs(), reachedNs() + 1);
  if (t0_ns >= t1_ns) return std::nullopt;
  const Window window = windowOf(t0_ns, t1_ns, options_.policy.reference);
  return WindowData{window, eventsOf(window), &trajectory_};
}

void FusionMapper::skipWindow(const Window& window) {
  policy_->advance(window, nullptr);
  releaseBefore(releasableUntil());
}

void FusionMapper::dropWindow(const Window& window, DropReason reason) {
  ++counts_.dropped_windows[reason];
  policy_->advance(window, nullptr);
  loseEvents(window.t0_ns, policy_->earliestStart(*this), reason);
  releaseBefore(releasableUntil());
}

bool FusionMapper::dropFailedWindow() {
  if (!failed_) return false;
  dropWindow(*std::exchange(failed_, std::nullopt), DropReason::kError);
  return true;
}

void FusionMapper::dropWindowsBefore(std::int64_t t_ns, DropReason reason) {
  for (CameraStream& camera : cameras_) camera.filterUntil(t_ns);
  std::int64_t from_ns = kMinTimeNs;
  std::int64_t until_ns = t_ns;
  if (start_ns_) {
    from_ns = policy_->earliestStart(*this);
    counts_.dropped_windows[reason] += policy_->dropWindowsBefore(*this, t_ns);
    until_ns = policy_->earliestStart(*this);
  }
  loseEvents(from_ns, until_ns, reason);
  releaseBefore(t_ns);
}

/// Drops the windows in [t0, t1).
void FusionMapper::loseEvents(std::int64_t t0_ns, std::int64_t t1_ns, DropReason reason) {
  if (reason == DropReason::kPaused) return;  // the host does not want these windows
  for (CameraStream& camera : cameras_) camera.dropWindows(t0_ns, t1_ns);
}

void FusionMapper::loseKeyframe() {
  --counts_.keyframes;
  ++counts_.dropped_windows[DropReason::kError];
}

std::size_t FusionMapper::heldEvents() const {
  std::size_t held = 0;
  for (const CameraStream& camera : cameras_) held += camera.heldEvents();
  return held;
}

std::uint64_t FusionMapper::readEvents() const {
  std::uint64_t read = 0;
  for (const CameraStream& camera : cameras_) read += camera.counts().read;
  return read;
}

std::int64_t FusionMapper::oldestHeldNs() const {
  std::int64_t oldest_ns = kMaxTimeNs;
  for (const CameraStream& camera : cameras_) {
    oldest_ns = std::min(oldest_ns, camera.firstFrom(kMinTimeNs).value_or(kMaxTimeNs));
  }
  return oldest_ns;
}

void FusionMapper::configure(const KeyframePolicyOptions& policy,
                             const DepthPlanesOptions& planes) {
  options_.policy = policy;
  setPlanes(planes);
  if (given_ns_) return;
  policy_ = makeKeyframePolicy(policy, depthGuess(planes));
  if (!start_ns_ || released_ns_ <= *start_ns_) return;
  const std::uint64_t dropped = policy_->dropWindowsBefore(*this, released_ns_);
  const std::uint64_t all = counts_.dropped_windows.total();
  std::uint64_t& no_scene = counts_.dropped_windows[DropReason::kNoScene];
  if (no_scene > 0 && counts_.keyframes == 0) {  // counted as windows of the new policy
    const std::uint64_t others = all - no_scene;
    no_scene = dropped - std::min(dropped, others);
  }
}

void FusionMapper::setPlanes(const DepthPlanesOptions& planes) {
  options_.keyframe.planes = planes;
  if (mapper_) mapper_->setPlanes(planes);
}

void FusionMapper::setMotion(const MotionCorrectionOptions& motion) {
  options_.keyframe.motion = motion;
  if (mapper_) mapper_->setMotion(motion);
}

/// Returns the current window if it is complete: all of its events and poses are here.
std::optional<Window> FusionMapper::completeWindow() {
  findStart();
  if (!start_ns_) return std::nullopt;
  skipEmptyWindows();
  const std::optional<Window> window = policy_->current(*this);
  return window && isComplete(*window) ? window : lastWindow();
}

/// Returns the window that ends with the recording, once all other windows are mapped. The events
/// that it needs may have been released when windows were dropped.
std::optional<Window> FusionMapper::lastWindow() {
  if (!finished_ || !options_.fill_last_window) return std::nullopt;
  std::optional<std::int64_t> last_ns;
  for (CameraStream& camera : cameras_) {
    last_ns = std::max(last_ns, camera.lastWithPose(trajectory_, completeNs()));
  }
  if (!last_ns) return std::nullopt;
  const std::optional<Window> window = policy_->last(*this, *last_ns + 1);
  return window && window->t0_ns >= released_ns_ ? window : std::nullopt;
}

std::vector<EventSpan> FusionMapper::eventsOf(const Window& window) const {
  std::vector<EventSpan> events;
  for (const CameraStream& camera : cameras_) {
    events.push_back(camera.between(window.t0_ns, window.t1_ns));
  }
  return events;
}

/// Filters an event once no earlier event of its camera can come.
void FusionMapper::filterEvents() {
  for (CameraStream& camera : cameras_) camera.filterUntil(completeUntil(camera));
}

/// Finds the start of the recording: the first event with a pose. Releases earlier events.
void FusionMapper::findStart() {
  if (given_ns_) start_ns_ = given_ns_;
  if (start_ns_ || trajectory_.empty()) return;
  std::int64_t first_ns = kMaxTimeNs;
  for (CameraStream& camera : cameras_) {
    const std::int64_t until_ns = std::min(first_ns, trajectory_.poses().back().t_ns + 1);
    first_ns = camera.firstWithPose(trajectory_, until_ns).value_or(first_ns);
  }
  // A camera that lags may still bring an earlier event.
  const std::int64_t released_ns = std::min(completeNs(), first_ns);
  for (CameraStream& camera : cameras_) camera.release(released_ns, trajectory_);
  if (first_ns < kMaxTimeNs && eventsCompleteNs() >= first_ns) start_ns_ = first_ns;
}

/// Skips the windows before the next event at once, however long the gap is.
void FusionMapper::skipEmptyWindows() {
  if (!reached_ns_) return;
  const std::int64_t from_ns = policy_->earliestStart(*this);
  std::int64_t empty_until_ns = std::min(*reached_ns_, options_.limits.t1_ns.value_or(kMaxTimeNs));
  for (const CameraStream& camera : cameras_) {
    if (!camera.selected()) continue;
    const auto next_ns = camera.firstFrom(from_ns);
    empty_until_ns = std::min(empty_until_ns, next_ns ? *next_ns : completeUntil(camera));
  }
  counts_.windows_without_events += policy_->advancePast(*this, empty_until_ns);
}

/// Returns whether a window is complete: all of its events and poses are here. Given windows are
/// complete after `finish` in any case.
bool FusionMapper::isComplete(const Window& window) const {
  if (given_ns_) {
    if (finished_) return true;
    if (reachedNs() < window.t1_ns) return false;
  }
  if (options_.limits.t1_ns && window.t1_ns > *options_.limits.t1_ns) return false;
  return completeNs() >= window.t1_ns && trajectory_.poses().back().t_ns >= window.t_ref_ns;
}

std::optional<KeyframeDepthMap> FusionMapper::mapWindow(const Window& window, DsiSink* sink,
                                                        StageTimes* times) {
  const std::vector<EventSpan> events = eventsOf(window);
  const auto count = [](std::uint64_t sum, EventSpan span) { return sum + span.size(); };
  const std::uint64_t num_events =
      std::accumulate(events.begin(), events.end(), std::uint64_t{0}, count);
  if (num_events == 0 && options_.planned_windows.empty()) {
    ++counts_.windows_without_events;
    return std::nullopt;
  }
  const auto mark_used = [&] {
    for (CameraStream& camera : cameras_) {
      camera.markUsed(window, trajectory_, options_.keyframe.max_events_per_camera);
    }
  };
  if (options_.on_planned && trajectory_.poseAt(window.t_ref_ns)) {
    mark_used();
    options_.on_planned(window, num_events);
    return std::nullopt;
  }
  auto keyframe = keyframeMapper().map(window, events, trajectory_, sink, times);
  if (!keyframe) {
    ++counts_.keyframes_without_pose;
    return std::nullopt;
  }
  ++counts_.keyframes;
  counts_.votes += keyframe->votes;
  counts_.silent_subintervals += keyframe->silent_subintervals;
  MotionCounts motion;
  motion.known = keyframe->blur_px ? 1 : 0;
  motion.blur_px = keyframe->blur_px.value_or(0);
  motion.corrected = keyframe->motion_correction ? 1 : 0;
  motion.log_gain = std::log(keyframe->sharpness_gain);
  counts_.motion += motion;
  counts_.event_uses =
      std::accumulate(keyframe->events.begin(), keyframe->events.end(), counts_.event_uses);
  mark_used();
  return keyframe;
}

KeyframeMapper& FusionMapper::keyframeMapper() const {
  if (!mapper_) {
    mapper_ = std::make_unique<KeyframeMapper>(rig_, selectedCameras(rig_, options_.cameras),
                                               options_.keyframe);
  }
  return *mapper_;
}

/// Returns the time before which events and poses are complete and no later window needs them.
std::int64_t FusionMapper::releasableUntil() const {
  std::int64_t start_ns = policy_->earliestStart(*this);
  if (options_.fill_last_window) start_ns = std::min(start_ns, policy_->earliestLast(*this));
  return finished_ ? start_ns : std::min(start_ns, completeNs());
}

/// Counts and releases the events before a time, and the poses that no later window needs.
void FusionMapper::releaseBefore(std::int64_t t_ns) {
  if (t_ns <= released_ns_) return;
  released_ns_ = t_ns;
  for (CameraStream& camera : cameras_) camera.release(t_ns, trajectory_);
  // The reference time of a window may lie before its events.
  trajectory_.forgetBefore(start_ns_ ? std::min(t_ns, policy_->earliestReference(*this)) : t_ns);
}

MapperCounts FusionMapper::counts() const {
  MapperCounts counts = counts_;
  for (const CameraStream& camera : cameras_) counts.cameras.push_back(camera.counts());
  return counts;
}

/// Returns the time until which a camera's events are complete.
std::int64_t FusionMapper::completeUntil(const CameraStream& camera) const {
  return finished_ ? kMaxTimeNs : std::max(camera.completeNs(), silent_ns_);
}

std::int64_t FusionMapper::eventsCompleteNs() const {
  std::int64_t complete_ns = kMaxTimeNs;
  for (const CameraStream& camera : cameras_) {
    if (camera.selected()) complete_ns = std::min(complete_ns, completeUntil(camera));
  }
  return complete_ns;
}

std::int64_t FusionMapper::completeNs() const {
  if (trajectory_.empty()) return kMinTimeNs;
  return std::min(trajectory_.poses().back().t_ns, eventsCompleteNs());
}

std::size_t FusionMapper::countBefore(std::int64_t t_ns) const {
  std::size_t count = 0;
  for (const CameraStream& camera : cameras_) count += camera.countBefore(t_ns);
  return count;
}

std::optional<std::int64_t> FusionMapper::timeOfEvent(std::int64_t from_ns,
                                                      std::int64_t count) const {
  const std::size_t wanted = countBefore(from_ns) + static_cast<std::size_t>(count);
  std::int64_t last_ns = completeNs();
  if (countBefore(last_ns) < wanted) return std::nullopt;
  // Finds the earliest time with `wanted` events at or before it.
  std::int64_t t_ns = from_ns;
  for (--last_ns; t_ns < last_ns;) {
    const std::int64_t middle_ns = t_ns + (last_ns - t_ns) / 2;
    if (countBefore(middle_ns + 1) >= wanted) {
      last_ns = middle_ns;
    } else {
      t_ns = middle_ns + 1;
    }
  }
  return t_ns;
}

std::optional<Rigid3> FusionMapper::viewPoseAt(std::int64_t t_ns) const {
  const std::optional<Rigid3> T_world_rig = trajectory_.poseAt(t_ns);
  if (!T_world_rig) return std::nullopt;
  return keyframeMapper().referencePose(*T_world_rig);
}

}  // namespace efm
