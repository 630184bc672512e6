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

#include "mapping/base/atomic_file.h"
#include "mapping/geometry/timestamp.h"
#include "plugin/engine/host_text.h"
#include "plugin/engine/mapper_driver.h"
#include "plugin/mrpt/CObservationEvents.h"
#include "plugin/mrpt/host_options.h"
#include "plugin/mrpt/pose_observation.h"
#include "plugin/results/pictures/depth_picture.h"

IMPLEMENTS_MRPT_OBJECT(CEventFusionMapBuilder, mrpt::rtti::CObject, efm)

namespace efm {
namespace {

/// Moves and inserts keyframes of a map until they equal `keyframes`. @return true if it changed.
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

/// Returns whether this is the comment by which a host that knows only MRPT ends the recording.
bool isFinish(const mrpt::obs::CObservation& observation) {
  const auto* comment = dynamic_cast<const mrpt::obs::CObservationComment*>(&observation);
  return comment != nullptr && comment->text == "event_fusion: finish";
}

}  // namespace

CEventFusionMapBuilder::CEventFusionMapBuilder(const EventFusionOptions& builder_options) {
  setLoggerName("CEventFusionMapBuilder");
  restart(builder_options);
}

// Stops while all members exist: the mapping's thread may be in a callback that uses the builder.
CEventFusionMapBuilder::~CEventFusionMapBuilder() {
  if (mapper_) mapper_->stop();
}

std::shared_ptr<MapperDriver> CEventFusionMapBuilder::mapper() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return mapper_;
}

std::shared_ptr<RigFromPackets> CEventFusionMapBuilder::packets() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return packets_;
}

/// @param earlier keyframes of an initial map.
void CEventFusionMapBuilder::restart(const EventFusionOptions& builder_options,
                                     std::vector<StoredKeyframe> earlier) {
  // Checked before the lock: the thread that holds it may wait for the end of this callback.
  if (const auto current = mapper(); current && current->runsHere()) {
    throw std::logic_error("the builder cannot start over from its own callback");
  }
  const std::lock_guard<std::mutex> restart_lock(restart_mutex_);
  auto next = MapperDriver::forHost(
      builder_options,
      Mapper::Callbacks{hosts(&CEventFusionMapBuilder::callback_),
                        hosts(&CEventFusionMapBuilder::map_callback_),
                        [this](const std::string& text) { MRPT_LOG_WARN(text); },
                        [this](const std::string& text) { MRPT_LOG_INFO(text); }},
      earlier);
  auto packets = std::make_shared<RigFromPackets>(builder_options, next);
  // Stopped without the lock: the mapper's thread may run a callback that uses the builder.
  if (const auto former = mapper()) former->stop();
  const std::lock_guard<std::mutex> lock(mutex_);
  mapper_ = std::move(next);
  packets_ = std::move(packets);
  mapper_->setSink(sink_);
  tracker_poses_ = {};
  options_ = builder_options;
  ignored_observations_ = 0;
  reckoning_ = {};
  warned_of_rounding_ = false;
}

void CEventFusionMapBuilder::setOptions(const EventFusionOptions& builder_options) {
  builder_options.validate();
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

/// Returns a function that calls the host's current callback, which may change during mapping.
template <typename Argument>
std::function<void(const Argument&)> CEventFusionMapBuilder::hosts(
    std::function<void(const Argument&)> CEventFusionMapBuilder::*callback) {
  return [this, callback](const Argument& argument) {
    std::function<void(const Argument&)> call;
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      call = this->*callback;
    }
    if (call) call(argument);
  };
}

void CEventFusionMapBuilder::setDsiSink(DsiSink* sink) {
  const std::lock_guard<std::mutex> lock(mutex_);
  sink_ = sink;
  mapper_->setSink(sink);
}

void CEventFusionMapBuilder::processObservation(const mrpt::obs::CObservation::Ptr& observation) {
  forHost(HostFace::kMapper, [&] { take(observation); });
}

void CEventFusionMapBuilder::take(const mrpt::obs::CObservation::Ptr& observation) {
  if (!observation) throw std::invalid_argument("the builder was given no observation (null)");
  if (const auto events = std::dynamic_pointer_cast<CObservationEvents>(observation)) {
    packets()->add(*events, options.enableMapUpdating);  // MRPT's option of every map builder
  } else if (auto pose = poseIn(*observation)) {
    const auto mapper = this->mapper();
    pose->T_body_rig = mapper->setup().T_body_rig.value_or(pose->T_body_rig);
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      tracker_poses_.add(*observation, *pose);
    }
    mapper->add(std::move(*pose));
  } else if (isFinish(*observation)) {
    finish();
  } else {
    const std::lock_guard<std::mutex> lock(mutex_);
    ++ignored_observations_;
  }
}

void CEventFusionMapBuilder::finish() {
  std::exception_ptr error;  // of cameras that never came: the others are mapped all the same
  try {
    forHost(HostFace::kMapper, [&] { packets()->finish(); });
  } catch (const std::invalid_argument&) {
    error = std::current_exception();
  }
  forHost(HostFace::kMapper, [&] { mapper()->finish(); });
  if (error) std::rethrow_exception(error);
}

std::shared_ptr<const MapSnapshot> CEventFusionMapBuilder::snapshot() const {
  const auto map = mapper()->newest(false);
  return map->points ? map : nullptr;
}

SessionStatus CEventFusionMapBuilder::status() const { return mapper()->statusForHost(); }

std::uint64_t CEventFusionMapBuilder::ignoredObservations() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return ignored_observations_;
}

MapCloud::ConstPtr CEventFusionMapBuilder::points() const { return mapper()->newest(true)->points; }

std::vector<StampedPose> CEventFusionMapBuilder::trajectory() const {
  return mapper()->newest(false)->trajectory;
}

std::vector<StampedPose> CEventFusionMapBuilder::trackerTrajectory() const {
  return mapper()->newest(false)->tracker_trajectory;
}

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

void CEventFusionMapBuilder::initialize(const mrpt::maps::CSimpleMap& initial_map,
                                        const mrpt::poses::CPosePDF* /*x0*/) {
  restart(usedOptions(), keyframesOf(initial_map));
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
  // After a bad observation the other observations are still processed.
  std::exception_ptr error;
  const auto process = [&](const mrpt::obs::CObservation::Ptr& observation) {
    try {
      processObservation(observation);
    } catch (...) {
      if (!error) error = std::current_exception();
    }
  };
  if (pose) process(pose);
  for (const mrpt::obs::CObservation::Ptr& observation : observations) process(observation);
  if (error) std::rethrow_exception(error);
}

/// Returns the mapper. Forgets results of an earlier mapper. The caller holds made_mutex_.
std::shared_ptr<MapperDriver> CEventFusionMapBuilder::mapperOfMade() const {
  const auto mapper = this->mapper();
  if (made_of_.lock() == mapper) return mapper;
  made_of_ = mapper;
  clouds_.clear();
  metric_map_ = nullptr;
  shown_points_ = nullptr;
  event_map_ = nullptr;
  return mapper;
}

void CEventFusionMapBuilder::getCurrentlyBuiltMap(mrpt::maps::CSimpleMap& out_map) const {
  out_map.clear();
  const std::lock_guard<std::mutex> lock(made_mutex_);
  const auto map = mapperOfMade()->newest(false);
  decltype(clouds_) clouds;  // without the clouds of keyframes that are forgotten
  for (const StoredKeyframe& keyframe : map->keyframes) {
    auto& cloud = clouds[keyframe.points];
    const auto known = clouds_.find(keyframe.points);
    cloud = known != clouds_.end() ? known->second : cloudOf(keyframe);
    insertInto(out_map, keyframe, cloud);
  }
  clouds_ = std::move(clouds);
}

unsigned int CEventFusionMapBuilder::getCurrentlyBuiltMapSize() {
  return static_cast<unsigned int>(mapper()->newest(false)->keyframes.size());
}

const mrpt::maps::CMultiMetricMap* CEventFusionMapBuilder::getCurrentlyBuiltMetricMap() const {
  std::unique_lock<std::mutex> lock(made_mutex_);
  const auto mapper = mapperOfMade();
  const GlobalCloudOptions cloud_options = mapper->usedOptions().cloud;
  const auto map_so_far = mapper->newest(false);
  MapCloud::ConstPtr points = map_so_far->points;  // null in playback
  if (!points) {
    points = shown_points_;
    if (!event_map_) event_map_ = std::make_shared<CEventFusionMap>(cloud_options);
    const bool changed = bringUpToDate(*event_map_, map_so_far->keyframes);
    if (changed || !points) points = event_map_->cloud().points();
  }
  if (!metric_map_ || points != shown_points_) {
    metric_map_ = std::make_shared<mrpt::maps::CMultiMetricMap>();
    if (event_map_) metric_map_->maps.push_back(event_map_);
    metric_map_->maps.push_back(pointsMapOf(*points));
    shown_points_ = points;
  }
  const mrpt::maps::CMultiMetricMap* const map = metric_map_.get();
  lock.unlock();
  warnOfRounding(*points);
  return map;
}

/// Warns once.
void CEventFusionMapBuilder::warnOfRounding(const MapCloud& points) const {
  if (warned_of_rounding_) return;
  const auto warning = roundingWarning(points, mapper()->usedOptions().cloud.voxel_size_m);
  if (warning && !warned_of_rounding_.exchange(true)) MRPT_LOG_WARN(*warning);
}

void CEventFusionMapBuilder::saveCurrentEstimationToImage(const std::string& file,
                                                          bool /*format_emf_bmp*/) {
  const auto [depth, planes] = mapper()->newestDepth();
  if (depth.empty()) throw std::logic_error("there is no keyframe to save an image of yet");
  const cv::Mat3b picture = depthPicture(depth, planes, Palette::kBrightToDark);
  writeAtomically(file, [&](const std::filesystem::path& temporary) {
    if (!cv::imwrite(temporary.string(), picture)) throw std::runtime_error("imwrite failed");
  });
}

}  // namespace efm
