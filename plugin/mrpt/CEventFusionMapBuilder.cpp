// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/mrpt/CEventFusionMapBuilder.h"

#include <fmt/format.h>
#include <mrpt/maps/CSimpleMap.h>
#include <mrpt/obs/CObservationComment.h>
#include <mrpt/obs/CSensoryFrame.h>
#include <mrpt/poses/CPose3DPDFGaussian.h>

#include <exception>
#include <opencv2/imgcodecs.hpp>
#include <stdexcept>
#include <utility>

#include "mapping/geometry/timestamp.h"
#include "maps/io/atomic_file.h"
#include "plugin/mrpt/CObservationEvents.h"
#include "plugin/mrpt/host_options.h"
#include "plugin/mrpt/mrpt_pose.h"
#include "plugin/mrpt/mrpt_time.h"
#include "plugin/mrpt/points_map.h"
#include "plugin/mrpt/pose_observation.h"
#include "plugin/mrpt/session_feed.h"
#include "plugin/pictures/depth_picture.h"

IMPLEMENTS_MRPT_OBJECT(CEventFusionMapBuilder, mrpt::rtti::CObject, efm)

namespace efm {
namespace {

/// The exception of a step; null if it throws none.
template <typename Step>
std::exception_ptr errorOf(Step step) {
  try {
    step();
  } catch (...) {
    return std::current_exception();
  }
  return nullptr;
}

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

std::vector<StampedPose> posesOf(const std::vector<StoredKeyframe>& keyframes) {
  std::vector<StampedPose> poses;
  for (const StoredKeyframe& keyframe : keyframes) {
    poses.push_back({keyframe.t_ref_ns, keyframe.T_world_ref});
  }
  return poses;
}

/// A host that knows MRPT alone ends the recording by this.
bool isFinish(const mrpt::obs::CObservation& observation) {
  const auto* comment = dynamic_cast<const mrpt::obs::CObservationComment*>(&observation);
  return comment != nullptr && comment->text == "event_fusion: finish";
}

}  // namespace

CEventFusionMapBuilder::CEventFusionMapBuilder(const EventFusionOptions& builder_options) {
  setLoggerName("CEventFusionMapBuilder");
  restart(builder_options);
}

CEventFusionMapBuilder::~CEventFusionMapBuilder() {
  if (const auto live = liveMapping()) live->stop();
}

std::shared_ptr<LiveMapping> CEventFusionMapBuilder::liveMapping() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return live_;
}

/// @param earlier keyframes of an initial map.
void CEventFusionMapBuilder::restart(const EventFusionOptions& builder_options,
                                     std::vector<StoredKeyframe> earlier) {
  const std::shared_ptr<LiveMapping> former = liveMapping();
  if (former && former->runsHere()) {
    throw std::logic_error("the builder cannot start over from its own callback");
  }
  const std::lock_guard<std::mutex> restart_lock(restart_mutex_);
  std::unique_ptr<MappingSession> session;
  std::shared_ptr<LiveMapping> live;
  if (builder_options.live.enabled) {
    live =
        std::make_shared<LiveMapping>(builder_options, std::exchange(earlier, {}), liveCallbacks());
  } else {
    session = std::make_unique<MappingSession>(builder_options);
    for (const StoredKeyframe& keyframe : earlier) {
      session->insertEarlier(worldPointsOf(keyframe), keyframe.T_world_ref);
    }
  }
  // Without the lock: its thread may run a callback that uses the builder.
  if (former) former->stop();
  const std::lock_guard<std::mutex> lock(mutex_);
  live_ = std::move(live);
  if (live_) {
    live_->setSink(sink_);
    live_->setClock(clock_);
  }
  handed_out_.reset();
  tracker_poses_.clear();
  session_ = std::move(session);
  options_ = builder_options;
  finished_ = false;
  ignored_observations_ = 0;
  reckoning_ = {};
  keyframes_ = std::move(earlier);
  newest_depth_ = {};
  silent_cameras_.clear();
  metric_map_.maps.clear();
  event_map_.reset();
}

void CEventFusionMapBuilder::setOptions(const EventFusionOptions& builder_options) {
  builder_options.mapper.validate();
  builder_options.cloud.validate();
  builder_options.refinement.validate();
  builder_options.live.validate();
  restart(builder_options);
}

EventFusionOptions CEventFusionMapBuilder::usedOptions() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return options_;
}

void CEventFusionMapBuilder::setKeyframeCallback(KeyframeCallback callback) {
  const std::lock_guard<std::mutex> lock(mutex_);
  callback_ = std::move(callback);
}

void CEventFusionMapBuilder::setMapCallback(MapCallback callback) {
  const std::lock_guard<std::mutex> lock(mutex_);
  map_callback_ = std::move(callback);
}

LiveMapping::Callbacks CEventFusionMapBuilder::liveCallbacks() {
  LiveMapping::Callbacks callbacks;
  callbacks.on_keyframe = [this](const KeyframeDepthMap& keyframe) {
    std::vector<std::string> warnings;
    KeyframeCallback callback;
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      warnings = warningsOfSilence(keyframe);
      callback = callback_;
    }
    for (const std::string& warning : warnings) MRPT_LOG_WARN(warning);
    if (callback) callback(keyframe);
  };
  callbacks.on_map = [this](const std::shared_ptr<const MapSnapshot>& map) {
    MapCallback callback;
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      callback = map_callback_;
    }
    if (callback) callback(map);
  };
  callbacks.warn = [this](const std::string& text) { MRPT_LOG_WARN(text); };
  return callbacks;
}

void CEventFusionMapBuilder::setDsiSink(DsiSink* sink) {
  const std::lock_guard<std::mutex> lock(mutex_);
  sink_ = sink;
  if (live_) live_->setSink(sink);
}

void CEventFusionMapBuilder::setProcessorClock(ProcessorClock clock) {
  const std::lock_guard<std::mutex> lock(mutex_);
  clock_ = std::move(clock);
  if (live_) live_->setClock(clock_);
}

void CEventFusionMapBuilder::advance(const std::function<void(MappingSession&)>& feed) {
  std::exception_ptr error;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (finished_) throw std::logic_error("the builder was given an observation after its end");
    error = errorOf([&] { feed(*session_); });
  }
  // A refused observation does not stop the mapping of earlier ones.
  const std::exception_ptr mapping_error = errorOf([this] { mapComplete(); });
  if (!error) error = mapping_error;
  if (error) std::rethrow_exception(error);
}

/// Moves cloud and keyframes to their refined poses, under the lock, so that all queries agree.
void CEventFusionMapBuilder::applyPending() const {
  session_->applyPending();
  auto* self = const_cast<CEventFusionMapBuilder*>(this);  // NOLINT: MRPT's queries are const
  self->followRefinement();
}

/// Gives the stored keyframes the poses of the cloud's keyframes.
void CEventFusionMapBuilder::followRefinement() {
  const std::vector<Rigid3>& T_world_ref = session_->T_world_ref();
  const std::size_t earlier = keyframes_.size() - T_world_ref.size();
  for (std::size_t i = 0; i < T_world_ref.size(); ++i) {
    keyframes_[earlier + i].T_world_ref = T_world_ref[i];
  }
}

void CEventFusionMapBuilder::mapComplete() {
  std::exception_ptr error;
  const auto keepFirst = [&](const std::exception_ptr& next) {
    if (!error) error = next;
  };
  std::optional<MadeKeyframe> made;
  do {
    made.reset();
    keepFirst(errorOf([&] { made = mapNext(); }));
    if (made) keepFirst(errorOf([&] { deliver(*made); }));
  } while (made);
  if (error) std::rethrow_exception(error);
}

std::optional<CEventFusionMapBuilder::MadeKeyframe> CEventFusionMapBuilder::mapNext() {
  const std::lock_guard<std::mutex> lock(mutex_);
  // Within a callback: the caller of the callback goes on mapping.
  if (delivering_.count(std::this_thread::get_id()) != 0) return std::nullopt;
  std::optional<KeyframeDepthMap> keyframe = session_->next(sink_, clock_);
  if (keyframe) keyframes_.push_back(storedKeyframe(*keyframe, session_->pointsOf(*keyframe)));
  followRefinement();
  if (!keyframe) return std::nullopt;
  newest_depth_ = keyframe->map.depth;
  std::vector<std::string> warnings = warningsOfSilence(*keyframe);
  return MadeKeyframe{std::move(*keyframe), callback_, std::move(warnings)};
}

void CEventFusionMapBuilder::deliver(const MadeKeyframe& made) {
  const auto self = std::this_thread::get_id();
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    delivering_.insert(self);
  }
  const std::exception_ptr error = errorOf([&] {
    for (const std::string& warning : made.warnings) MRPT_LOG_WARN(warning);
    if (made.callback) made.callback(made.keyframe);
  });
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    delivering_.erase(self);
  }
  if (error) std::rethrow_exception(error);
}

/// One warning per camera. `status` counts the silent keyframes.
std::vector<std::string> CEventFusionMapBuilder::warningsOfSilence(
    const KeyframeDepthMap& keyframe) {
  std::vector<std::string> warnings;
  for (const int camera : keyframe.silent_cameras) {
    if (!silent_cameras_.insert(camera).second) continue;
    warnings.push_back(fmt::format("camera {} had no event for the keyframe at {} s", camera,
                                   formatSeconds(keyframe.window.t_ref_ns)));
  }
  return warnings;
}

void CEventFusionMapBuilder::processObservation(const mrpt::obs::CObservation::Ptr& observation) {
  if (!observation) throw std::invalid_argument("the builder was given no observation (null)");
  if (const auto events = std::dynamic_pointer_cast<CObservationEvents>(observation)) {
    addEvents(packetOf(*events));
  } else if (poseSourceOf(*observation)) {
    addPose(*observation);
  } else if (isFinish(*observation)) {
    finish();
  } else {
    const std::lock_guard<std::mutex> lock(mutex_);
    ++ignored_observations_;
  }
}

void CEventFusionMapBuilder::addEvents(CameraPacket packet) {
  const bool updates = options.enableMapUpdating;  // MRPT's, of every map builder
  if (const auto live = liveMapping()) {
    if (updates) {
      live->input().add(std::move(packet));
    } else {
      live->input().skip(packet);
    }
    return;
  }
  advance([&](MappingSession& session) {
    if (updates) {
      session.addEvents(std::move(packet));
    } else {
      session.skipEvents(packet);
    }
  });
}

void CEventFusionMapBuilder::addPose(const mrpt::obs::CObservation& observation) {
  // Under the lock.
  const auto note = [&](const std::optional<Rigid3>& T_body_rig) {
    const std::optional<ObservedPose> observed = poseIn(observation);
    const Rigid3 T_world_rig = rigPose(*observed, T_body_rig);
    tracker_poses_.add(observation, *observed, T_world_rig);
    return QueuedPose{{observed->t_ns, T_world_rig}, *poseSourceOf(observation), observed->noise};
  };
  if (const auto live = liveMapping()) {
    const std::lock_guard<std::mutex> lock(mutex_);
    live->input().add(note(live->T_body_rig()));
    return;
  }
  advance([&](MappingSession& session) {
    const QueuedPose pose = note(session.setup().T_body_rig);
    session.addPose(pose.pose, pose.source, pose.noise);
  });
}

void CEventFusionMapBuilder::finish() {
  if (const auto live = liveMapping()) {
    live->finish();
    return;
  }
  advance([this](MappingSession& session) {
    finished_ = true;
    session.finish();
  });
}

std::shared_ptr<const MapSnapshot> CEventFusionMapBuilder::snapshot() const {
  const auto live = liveMapping();
  return live ? live->map() : nullptr;
}

SessionStatus CEventFusionMapBuilder::status() const {
  if (const auto live = liveMapping()) return live->status();
  const std::lock_guard<std::mutex> lock(mutex_);
  return session_->status();
}

std::uint64_t CEventFusionMapBuilder::ignoredObservations() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return ignored_observations_;
}

std::vector<CloudPoint> CEventFusionMapBuilder::points() const {
  if (const auto live = liveMapping()) return live->map()->points;
  const std::lock_guard<std::mutex> lock(mutex_);
  applyPending();
  return session_->cloud().points();
}

std::vector<StampedPose> CEventFusionMapBuilder::trajectory() const {
  if (const auto live = liveMapping()) return live->map()->trajectory;
  const std::lock_guard<std::mutex> lock(mutex_);
  applyPending();
  return posesOf(keyframes_);
}

std::vector<StampedPose> CEventFusionMapBuilder::trackerTrajectory() const {
  const auto withTracker = [](std::vector<StampedPose> poses,
                              const std::vector<Rigid3>& T_odom_ref) {
    const std::size_t earlier = poses.size() - T_odom_ref.size();
    for (std::size_t i = 0; i < T_odom_ref.size(); ++i) {
      poses[earlier + i].T_world_rig = T_odom_ref[i];
    }
    return poses;
  };
  if (const auto live = liveMapping()) {
    const auto map = live->map();
    return withTracker(map->trajectory, map->T_odom_ref);
  }
  const std::lock_guard<std::mutex> lock(mutex_);
  return withTracker(posesOf(keyframes_), session_->T_odom_ref());
}

// --- mrpt::config::CLoadableOptions ----------------------------------------------------------

void CEventFusionMapBuilder::loadFromConfigFile(const mrpt::config::CConfigFileBase& source,
                                                const std::string& prefix) {
  OptionReader reader(usedOptions());
  readHostOptions(source, prefix, reader);
  setOptions(reader.options());
}

void CEventFusionMapBuilder::saveToConfigFile(mrpt::config::CConfigFileBase& target,
                                              const std::string& prefix) const {
  writeHostOptions(usedOptions(), prefix, target);
}

// --- mrpt::slam::CMetricMapBuilder -----------------------------------------------------------

void CEventFusionMapBuilder::initialize(const mrpt::maps::CSimpleMap& initial_map,
                                        const mrpt::poses::CPosePDF* /*x0*/) {
  std::vector<StoredKeyframe> earlier = keyframesOf(initial_map);
  for (StoredKeyframe& keyframe : earlier) {  // the host may change its clouds
    keyframe.points = std::make_shared<mrpt::maps::CPointsMapXYZI>(*keyframe.points);
  }
  restart(usedOptions(), std::move(earlier));
}

mrpt::poses::CPose3DPDF::Ptr CEventFusionMapBuilder::getCurrentPoseEstimation() const {
  const SessionStatus status = this->status();
  const std::lock_guard<std::mutex> lock(mutex_);
  auto estimate = mrpt::poses::CPose3DPDFGaussian::Create();
  const mrpt::poses::CPose3DPDFGaussian* newest = tracker_poses_.newest(status.pose_source);
  if (newest == nullptr) return estimate;
  *estimate = *newest;
  if (!status.refinement) return estimate;
  const Rigid3 T_world_rig = status.refinement->T_world_odom * rigidFrom(newest->mean);
  return std::make_shared<mrpt::poses::CPose3DPDFGaussian>(
      mrptPoseFrom(T_world_rig, covarianceAt(*status.refinement, T_world_rig)));
}

void CEventFusionMapBuilder::processActionObservation(mrpt::obs::CActionCollection& action,
                                                      mrpt::obs::CSensoryFrame& observations) {
  mrpt::obs::CObservation::Ptr pose;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    pose = reckoning_.poseAfter(action, observations);
  }
  // One bad observation takes no other one with it.
  std::exception_ptr error;
  const auto process = [&](const mrpt::obs::CObservation::Ptr& observation) {
    const std::exception_ptr refusal = errorOf([&] { processObservation(observation); });
    if (!error) error = refusal;
  };
  if (pose) process(pose);
  for (const mrpt::obs::CObservation::Ptr& observation : observations) process(observation);
  if (error) std::rethrow_exception(error);
}

void CEventFusionMapBuilder::getCurrentlyBuiltMap(mrpt::maps::CSimpleMap& out_map) const {
  if (const auto live = liveMapping()) {
    out_map.clear();
    for (const SimpleMapFrame& frame : live->map()->frames) out_map.insert(frame.pose, frame.frame);
    return;
  }
  const std::lock_guard<std::mutex> lock(mutex_);
  applyPending();
  out_map.clear();
  for (const StoredKeyframe& keyframe : keyframes_) insertInto(out_map, keyframe);
}

unsigned int CEventFusionMapBuilder::getCurrentlyBuiltMapSize() {
  if (const auto live = liveMapping()) {
    return static_cast<unsigned int>(live->map()->frames.size());
  }
  const std::lock_guard<std::mutex> lock(mutex_);
  return static_cast<unsigned int>(keyframes_.size());
}

const mrpt::maps::CMultiMetricMap* CEventFusionMapBuilder::getCurrentlyBuiltMetricMap() const {
  if (const auto live = liveMapping()) {
    const std::lock_guard<std::mutex> lock(mutex_);
    handed_out_ = live->map();
    return &handed_out_->metric_map;
  }
  const std::lock_guard<std::mutex> lock(mutex_);
  applyPending();
  if (!event_map_) event_map_ = std::make_shared<CEventFusionMap>(options_.cloud);
  const bool changed = bringUpToDate(*event_map_, keyframes_);
  if (metric_map_.maps.empty() || changed) {
    metric_map_.maps.clear();
    metric_map_.maps.push_back(event_map_);
    metric_map_.maps.push_back(pointsMapOf(event_map_->cloud().points()));
  }
  return &metric_map_;
}

void CEventFusionMapBuilder::saveCurrentEstimationToImage(const std::string& file,
                                                          bool /*format_emf_bmp*/) {
  cv::Mat1f depth;
  DepthPlanesOptions planes;
  if (const auto live = liveMapping()) {
    std::tie(depth, planes) = live->newestDepth();
  } else {
    const std::lock_guard<std::mutex> lock(mutex_);
    depth = newest_depth_;
    planes = session_->planes();
  }
  if (depth.empty()) throw std::logic_error("there is no keyframe to save an image of yet");
  const cv::Mat3b picture = depthPicture(depth, planes, Palette::kBrightToDark);
  writeAtomically(file, [&](const std::filesystem::path& temporary) {
    if (!cv::imwrite(temporary.string(), picture)) throw std::runtime_error("imwrite failed");
  });
}

}  // namespace efm
