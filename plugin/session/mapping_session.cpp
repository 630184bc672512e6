// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/session/mapping_session.h"

#include <fmt/format.h>

#include <algorithm>
#include <exception>
#include <iterator>
#include <limits>
#include <stdexcept>
#include <utility>

#include "mapping/geometry/timestamp.h"

namespace efm {
namespace {

/// A new camera may appear within this time of the recording's first event.
constexpr std::int64_t kRigCompletesNs = kNanosecondsPerSecond;
/// The same limit if the map is requested.
constexpr std::int64_t kRigCompletesEarlyNs = kNanosecondsPerSecond / 10;

/// In live operation, automatic options are chosen from the first window of this length.
constexpr double kFirstWindowS = 1;

bool sameCalibration(const RigCamera& a, const RigCamera& b) {
  return a.model == b.model && isSame(a.T_rig_cam, b.T_rig_cam) &&
         a.time_offset_ns == b.time_offset_ns;
}

void extend(std::optional<TimeSpan>& span, std::int64_t t_ns) {
  if (!span) span = TimeSpan{t_ns, t_ns};
  span->first_ns = std::min(span->first_ns, t_ns);
  span->last_ns = std::max(span->last_ns, t_ns);
}

/// Late fusion needs the maps of single cameras.
FusionMapperOptions mapperOptions(const EventFusionOptions& options) {
  FusionMapperOptions mapper = options.mapper;
  if (options.late_fusion) mapper.keyframe.camera_maps = true;
  return options.automatic.any() ? surveyOptions(mapper, kFirstWindowS) : mapper;
}

}  // namespace

MappingSession::MappingSession(const EventFusionOptions& options)
    : options_(options),
      rig_(options),
      pose_source_(options.rig.pose_source),
      mapper_(mapperOptions(options)),
      cloud_(options.cloud, options.refinement.enabled) {
  if (options.refinement.enabled) {
    refinement_ = std::make_unique<MapRefinement>(options.refinement);
  }
}

void MappingSession::addEvents(CameraPacket packet) {
  std::vector<CameraPacket> packets;
  {
    const SecondsScope scope(status_.times.real.tables, status_.times.cpu.tables, processSeconds);
    packets = rig_.add(std::move(packet), mapper_);
  }
  // A refused packet takes no other one with it.
  std::exception_ptr refusal;
  for (CameraPacket& ready : packets) {
    try {
      feed(std::move(ready));
    } catch (const std::invalid_argument&) {
      if (!refusal) refusal = std::current_exception();
    }
  }
  if (refusal) std::rethrow_exception(refusal);
}

void MappingSession::feed(CameraPacket packet) {
  const RigCamera& camera = mapper_.rig().cameras[static_cast<std::size_t>(packet.camera)];
  if (!sameCalibration(camera, packet.calibration)) {
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
    mapper_.addEvents(packet.camera, std::move(packet.events));
  }
  if (packet.covered_until_ns) mapper_.coverUntil(packet.camera, *packet.covered_until_ns);
  if (empty) return;
  const std::int64_t begin_ns = first_ns + camera.time_offset_ns;
  extend(status_.events, begin_ns);
  extend(status_.events, last_ns + camera.time_offset_ns);
  newest_begin_ns_ = std::max(newest_begin_ns_.value_or(begin_ns), begin_ns);
  // Without a wait where neither another camera nor a better source of poses can come.
  const bool known = rig_.isKnown() && pose_source_.selected();
  if (known || seenFor(kRigCompletesNs)) completeRig();
}

/// Whether a packet began this long after the first event: by then every camera has sent one,
/// whatever the length of packets.
bool MappingSession::seenFor(std::int64_t duration_ns) const {
  return newest_begin_ns_ && *newest_begin_ns_ - status_.events->first_ns > duration_ns;
}

void MappingSession::completeRig() {
  if (rig_.isComplete()) return;
  rig_.requireOptionsFit();
  usePoses(pose_source_.select());
  rig_.complete();
}

void MappingSession::addPose(const StampedPose& pose, const PoseSourceId& source,
                             const std::optional<PoseNoise>& noise) {
  usePoses(pose_source_.add(source, pose));
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

void MappingSession::usePoses(const std::vector<StampedPose>& poses) {
  for (const StampedPose& pose : poses) {
    mapper_.addPose(pose);
    extend(status_.poses, pose.t_ns);
    if (!newest_pose_ || pose.t_ns >= newest_pose_->t_ns) newest_pose_ = pose;
  }
}

void MappingSession::insertEarlier(const std::vector<CloudPoint>& points,
                                   const Rigid3& T_world_ref) {
  cloud_.insertFixed(points, T_world_ref);
}

void MappingSession::completeEarly() {
  // Another camera or a better source of poses may still come.
  if (rig_.anyCameraWaits() || !pose_source_.selected() || !seenFor(kRigCompletesEarlyNs)) return;
  completeRig();
}

void MappingSession::finish() {
  finished_ = true;
  usePoses(pose_source_.select());
  mapper_.finish();
  completeRig();
  rig_.requireNoneWaits();
}

std::optional<KeyframeDepthMap> MappingSession::next(DsiSink* sink, const ProcessorClock& clock) {
  if (!rig_.isComplete() || !chooseAutomatic()) return std::nullopt;
  StageTimer timer(status_.times, clock);
  std::optional<KeyframeDepthMap> keyframe = mapper_.next(sink, &timer);
  if (keyframe) {
    if (depth_follower_ && depth_follower_->follow(keyframe->map.depth)) {
      mapper_.setPlanes(depth_follower_->planes());
    }
    insert(*keyframe);
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

/// Chooses automatic options as soon as the first window is there. @return whether none is left.
bool MappingSession::chooseAutomatic() {
  if (!options_.automatic.any()) return true;
  const std::optional<WindowData> first = mapper_.window();
  if (!first && !finished_) return false;
  std::vector<WindowSample> samples;
  std::optional<double> duration_s;  // not known before the end
  if (first) {
    samples.push_back(sampleOf(*first));
    if (finished_) duration_s = secondsBetween(first->window.t0_ns, first->window.t1_ns);
  }
  status_.chosen =
      chooseOptions(options_.automatic, mapper_.rig(), samples, duration_s, options_.mapper);
  const AutomaticOptions automatic = std::exchange(options_.automatic, {});
  if (automatic.min_depth_m || automatic.max_depth_m) {
    depth_follower_.emplace(automatic, options_.mapper.keyframe.planes);
  }
  mapper_.configure(options_.mapper.policy, options_.mapper.keyframe.planes);
  return true;
}

/// Inserts a keyframe into the cloud, refines it, and moves it and others to their refined poses.
/// Cloud and refinement number keyframes alike: after an error neither has the keyframe.
void MappingSession::insert(KeyframeDepthMap& keyframe) {
  const Rigid3 T_odom_ref = keyframe.T_world_ref;
  status_.silent_keyframes.resize(mapper_.rig().cameras.size());
  T_odom_ref_.push_back(T_odom_ref);
  try {
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
  status.counts = mapper_.counts();
  status.pose_source = pose_source_.selected();
  status.other_poses = pose_source_.unused();
  status.rig = mapper_.rig();
  status.silent_keyframes.resize(status.rig.cameras.size());
  status.recalibrated_cameras = rig_.recalibratedCameras();
  if (refinement_) {
    status.refinement = refinement_->state();
    status.times.real.refine = status.refinement->seconds;
    status.times.cpu.refine = status.refinement->cpu_seconds;
  }
  return status;
}

}  // namespace efm
