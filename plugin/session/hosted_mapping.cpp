// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/session/hosted_mapping.h"

#include <stdexcept>

#include "plugin/session/health_checks.h"
#include "plugin/session/live_mapping.h"

namespace efm {

std::vector<CloudPoint> worldPointsOf(const StoredKeyframe& keyframe) {
  return pointsInWorld(*keyframe.points, keyframe.T_world_ref);
}

std::shared_ptr<HostedMapping> hostMapping(const EventFusionOptions& options,
                                           std::vector<StoredKeyframe> earlier,
                                           HostedMapping::Callbacks callbacks) {
  if (options.live.enabled) {
    return std::make_shared<LiveMapping>(options, std::move(earlier), std::move(callbacks));
  }
  return std::make_shared<PlaybackMapping>(options, std::move(earlier), std::move(callbacks));
}

KeyframePoses keyframePoses(std::vector<StampedPose> in_map,
                            const std::vector<Rigid3>& T_odom_ref) {
  KeyframePoses poses{in_map, std::move(in_map)};
  const std::size_t earlier = poses.by_tracker.size() - T_odom_ref.size();
  for (std::size_t i = 0; i < T_odom_ref.size(); ++i) {
    poses.by_tracker[earlier + i].T_world_rig = T_odom_ref[i];
  }
  return poses;
}

void tellChoice(const SessionStatus& status, const HostedMapping::Callbacks& callbacks) {
  if (callbacks.info) callbacks.info(choiceText(status));
  if (!status.scene_unknown || !callbacks.warn) return;
  const Warning warning = noSceneWarning();
  callbacks.warn(warning.name + ": " + warning.text);
}

PlaybackMapping::PlaybackMapping(const EventFusionOptions& options,
                                 std::vector<StoredKeyframe> earlier, Callbacks callbacks)
    : callbacks_(std::move(callbacks)), session_(options), keyframes_(std::move(earlier)) {
  for (const StoredKeyframe& keyframe : keyframes_) {
    session_.insertEarlier(worldPointsOf(keyframe), keyframe.T_world_ref);
  }
}

void PlaybackMapping::addEvents(EventPacket packet) {
  advance([&] { session_.addEvents(std::move(packet)); });
}

void PlaybackMapping::skipEvents(const EventPacket& packet) {
  if (packet.events.empty()) return;
  advance([&] { session_.endSurvey(); });  // maps what is complete so far
  advance([&] { session_.skipEvents(packet); });
}

void PlaybackMapping::addPose(const QueuedPose& pose) {
  advance([&] { session_.addPose(pose.pose, pose.source, pose.noise); });
}

void PlaybackMapping::finish() {
  advance([&] {
    finished_ = true;
    session_.finish();
  });
}

void PlaybackMapping::stop() {
  const std::lock_guard<std::mutex> lock(mutex_);
  stopped_ = true;
}

/// Feeds the session under the lock, then maps and delivers. Throws the first error at the end.
void PlaybackMapping::advance(const std::function<void()>& feed) {
  std::exception_ptr error;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (finished_) throw std::logic_error("the builder was given an observation after its end");
    error = exceptionOf(feed);
  }
  // A refused observation does not stop the mapping of earlier ones.
  const std::exception_ptr mapping_error = exceptionOf([this] { mapComplete(); });
  if (!error) error = mapping_error;
  if (error) std::rethrow_exception(error);
}

/// Maps the complete windows and delivers their keyframes, one by one.
void PlaybackMapping::mapComplete() {
  std::exception_ptr error;
  const auto keepFirst = [&](const std::exception_ptr& next) {
    if (!error) error = next;
  };
  std::optional<KeyframeDepthMap> made;
  do {
    made.reset();
    keepFirst(exceptionOf([&] { made = mapNext(); }));
    keepFirst(exceptionOf([&] { tellChoice(); }));
    if (made) keepFirst(exceptionOf([&] { deliver(*made); }));
  } while (made);
  if (error) std::rethrow_exception(error);
}

/// Logs a choice of options, without the lock.
void PlaybackMapping::tellChoice() {
  SessionStatus status;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (session_.choices() == told_choices_) return;
    told_choices_ = session_.choices();
    status = session_.status();
  }
  efm::tellChoice(status, callbacks_);
}

std::optional<KeyframeDepthMap> PlaybackMapping::mapNext() {
  const std::lock_guard<std::mutex> lock(mutex_);
  // Within a callback: the caller of the callback goes on mapping.
  if (stopped_ || delivering_.count(std::this_thread::get_id()) != 0) return std::nullopt;
  const std::size_t kept = keyframes_.size();
  std::optional<KeyframeDepthMap> keyframe;
  try {
    keyframe = session_.next(sink_, clock_, [this](const KeyframeDepthMap& made) {
      keyframes_.push_back({made.window.t_ref_ns, made.T_world_ref,
                            std::make_shared<std::vector<ViewPoint>>(session_.pointsOf(made))});
    });
  } catch (...) {
    keyframes_.resize(kept);
    throw;
  }
  if (keyframe) newest_depth_ = keyframe->map.depth;
  followRefinement();
  return keyframe;
}

void PlaybackMapping::deliver(const KeyframeDepthMap& keyframe) {
  if (!callbacks_.on_keyframe) return;
  const auto self = std::this_thread::get_id();
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    delivering_.insert(self);
  }
  const std::exception_ptr error = exceptionOf([&] { callbacks_.on_keyframe(keyframe); });
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    delivering_.erase(self);
  }
  if (error) std::rethrow_exception(error);
}

/// Moves cloud and keyframes to their refined poses, under the lock, so that all queries agree.
void PlaybackMapping::applyPending() {
  session_.applyPending();
  followRefinement();
}

/// Gives the stored keyframes the poses of the cloud's keyframes.
void PlaybackMapping::followRefinement() {
  const std::vector<Rigid3>& T_world_ref = session_.T_world_ref();
  const std::size_t earlier = keyframes_.size() - T_world_ref.size();
  for (std::size_t i = 0; i < T_world_ref.size(); ++i) {
    keyframes_[earlier + i].T_world_ref = T_world_ref[i];
  }
}

void PlaybackMapping::setSink(DsiSink* sink) {
  const std::lock_guard<std::mutex> lock(mutex_);
  sink_ = sink;
}

void PlaybackMapping::setClock(ProcessorClock clock) {
  const std::lock_guard<std::mutex> lock(mutex_);
  clock_ = std::move(clock);
}

SessionStatus PlaybackMapping::status() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return session_.status();
}

MapCloud::ConstPtr PlaybackMapping::points() {
  const std::lock_guard<std::mutex> lock(mutex_);
  applyPending();
  return session_.cloud().points();
}

KeyframePoses PlaybackMapping::keyframePoses() {
  const std::lock_guard<std::mutex> lock(mutex_);
  applyPending();
  std::vector<StampedPose> poses;
  for (const StoredKeyframe& keyframe : keyframes_) {
    poses.push_back({keyframe.t_ref_ns, keyframe.T_world_ref});
  }
  return efm::keyframePoses(std::move(poses), session_.T_odom_ref());
}

std::size_t PlaybackMapping::numKeyframes() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return keyframes_.size();
}

std::vector<StoredKeyframe> PlaybackMapping::keyframes() {
  const std::lock_guard<std::mutex> lock(mutex_);
  applyPending();
  return keyframes_;
}

std::pair<cv::Mat1f, DepthPlanesOptions> PlaybackMapping::newestDepth() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return {newest_depth_, session_.planes()};
}

}  // namespace efm
