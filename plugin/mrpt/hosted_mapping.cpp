// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/mrpt/hosted_mapping.h"

#include <stdexcept>

#include "plugin/mrpt/pose_observation.h"
#include "plugin/session/health_checks.h"

namespace efm {

CameraPacket packetOf(const CObservationEvents& observation) {
  CameraPacket packet;
  packet.camera = observation.camera_index;
  packet.calibration.model = observation.camera;
  packet.calibration.T_rig_cam = rigidFrom(observation.camera_pose);
  packet.calibration.time_offset_ns = observation.time_offset_ns;
  packet.events = observation.events;
  packet.covered_until_ns = observation.covered_until_ns;
  return packet;
}

void addTo(RecordingSurveyor& surveyor, const mrpt::obs::CObservation& observation) {
  if (const auto* events = dynamic_cast<const CObservationEvents*>(&observation)) {
    surveyor.addEvents(packetOf(*events));
  } else if (const std::optional<ObservedPose> observed = poseIn(observation)) {
    const std::optional<Rigid3>& given = surveyor.setup().T_body_rig;
    surveyor.addPose({observed->t_ns, rigPose(*observed, given)}, *poseSourceOf(observation),
                     given.value_or(observed->T_body_rig));
  }
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

namespace {

/// Moves and inserts keyframes of a map until they equal `keyframes`. @return whether it changed.
bool bringUpToDate(CEventFusionMap& map, const std::vector<StoredKeyframe>& keyframes) {
  bool changed = map.keyframes().size() < keyframes.size();
  for (std::size_t i = 0; i < map.keyframes().size(); ++i) {
    if (isSame(map.keyframes()[i].T_world_ref, keyframes[i].T_world_ref)) continue;
    map.moveKeyframe(i, keyframes[i].T_world_ref);
    changed = true;
  }
  for (std::size_t i = map.keyframes().size(); i < keyframes.size(); ++i) {
    map.insertKeyframe(keyframes[i]);
  }
  return changed;
}

}  // namespace

PlaybackMapping::PlaybackMapping(const EventFusionOptions& options,
                                 std::vector<StoredKeyframe> earlier, Callbacks callbacks)
    : cloud_options_(options.cloud),
      callbacks_(std::move(callbacks)),
      session_(options),
      keyframes_(std::move(earlier)) {
  for (const StoredKeyframe& keyframe : keyframes_) {
    session_.insertEarlier(worldPointsOf(keyframe), keyframe.T_world_ref);
  }
}

void PlaybackMapping::addEvents(CameraPacket packet) {
  advance([&] { session_.addEvents(std::move(packet)); });
}

void PlaybackMapping::skipEvents(const CameraPacket& packet) {
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
      keyframes_.push_back(storedKeyframe(made, session_.pointsOf(made)));
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

std::size_t PlaybackMapping::simpleMapSize() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return keyframes_.size();
}

void PlaybackMapping::copyTo(mrpt::maps::CSimpleMap& map) {
  const std::lock_guard<std::mutex> lock(mutex_);
  applyPending();
  for (const StoredKeyframe& keyframe : keyframes_) insertInto(map, keyframe);
}

const mrpt::maps::CMultiMetricMap* PlaybackMapping::metricMap() {
  std::optional<std::string> warning;
  updateMetricMap(warning);
  if (warning && callbacks_.warn) callbacks_.warn(*warning);  // without the lock
  return &metric_map_;
}

/// @param warning is set the first time that the points are rounded.
void PlaybackMapping::updateMetricMap(std::optional<std::string>& warning) {
  const std::lock_guard<std::mutex> lock(mutex_);
  applyPending();
  if (!event_map_) event_map_ = std::make_shared<CEventFusionMap>(cloud_options_);
  const bool changed = bringUpToDate(*event_map_, keyframes_);
  if (metric_map_.maps.empty() || changed) {
    metric_map_.maps.clear();
    metric_map_.maps.push_back(event_map_);
    const MapCloud::ConstPtr points = event_map_->cloud().points();
    metric_map_.maps.push_back(pointsMapOf(*points));
    if (!warned_of_rounding_) warning = roundingWarning(*points, cloud_options_.voxel_size_m);
    warned_of_rounding_ = warned_of_rounding_ || warning;
  }
}

std::pair<cv::Mat1f, DepthPlanesOptions> PlaybackMapping::newestDepth() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return {newest_depth_, session_.planes()};
}

}  // namespace efm
