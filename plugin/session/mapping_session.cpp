// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/session/mapping_session.h"

#include <algorithm>
#include <exception>
#include <iterator>
#include <limits>
#include <stdexcept>
#include <utility>

#include "mapping/geometry/timestamp.h"
#include "mapping/options/option_check.h"

namespace efm {
namespace {

/// How long after the recording's first event cameras may first appear.
constexpr std::int64_t kRigCompletesNs = kNanosecondsPerSecond;
/// The same where somebody asks for the map.
constexpr std::int64_t kRigCompletesEarlyNs = kNanosecondsPerSecond / 10;

bool sameCalibration(const RigCamera& a, const RigCamera& b) {
  return a.model == b.model && isSame(a.T_rig_cam, b.T_rig_cam) &&
         a.time_offset_ns == b.time_offset_ns;
}

void extend(std::optional<TimeSpan>& span, std::int64_t t_ns) {
  if (!span) span = TimeSpan{t_ns, t_ns};
  span->first_ns = std::min(span->first_ns, t_ns);
  span->last_ns = std::max(span->last_ns, t_ns);
}

std::string asText(const TimeSpan& span) {
  return formatSeconds(span.first_ns) + " to " + formatSeconds(span.last_ns) + " s";
}

/// What the policy waits for before a window is one.
std::string fullWindow(const KeyframePolicyOptions& options) {
  std::string duration = formatSeconds(durationFromSeconds(options.window_s)) + " s (window_s)";
  switch (options.policy) {
    case KeyframePolicyKind::kPeriod:
      return duration;
    case KeyframePolicyKind::kEvents:
      return std::to_string(options.window_events) + " events (window_events)";
    case KeyframePolicyKind::kBaseline:
      return "at most " + duration + " with motion enough (min_baseline_ratio, min_visible_share)";
  }
  return duration;
}

/// What an option asks for although it is another's.
FusionMapperOptions mapperOptions(const EventFusionOptions& options) {
  FusionMapperOptions mapper = options.mapper;
  if (options.late_fusion) mapper.keyframe.camera_maps = true;
  return mapper;
}

}  // namespace

MappingSession::MappingSession(const EventFusionOptions& options)
    : options_(options),
      setup_(readRigSetup(options.rig)),
      mapper_(mapperOptions(options)),
      cloud_(options.cloud, options.refinement.enabled),
      pose_choice_(options.rig.pose_source) {
  if (options.refinement.enabled) {
    refinement_ = std::make_unique<MapRefinement>(options.refinement);
  }
}

void MappingSession::addEvents(CameraPacket packet) {
  if (packet.camera < 0) {
    throw std::invalid_argument("camera " + std::to_string(packet.camera) + ": must be 0 or above");
  }
  refit(packet);
  const int known = numCameras();
  if (packet.camera > known) {
    letWait(std::move(packet));
  } else if (packet.camera == known) {
    addCameras(std::move(packet));
  } else {
    feed(std::move(packet));
  }
}

/// Gives a packet the calibration and the time offset that the options say.
void MappingSession::refit(CameraPacket& packet) const {
  const auto camera = static_cast<std::size_t>(packet.camera);
  RigCamera& calibration = packet.calibration;
  if (setup_.calibration) {
    calibration = setup_.calibration->camera(
        camera, CameraSize{calibration.model.width, calibration.model.height});
  }
  const std::vector<std::int64_t>& offsets_ns = options_.rig.time_offsets_ns;
  if (offsets_ns.empty()) return;
  requireOption(camera < offsets_ns.size(), "[rig] time_offsets_s (how many)", offsets_ns.size(),
                "one per camera, and there is camera " + std::to_string(camera));
  calibration.time_offset_ns = offsets_ns[camera];
}

int MappingSession::numCameras() const { return static_cast<int>(mapper_.rig().cameras.size()); }

void MappingSession::refuseOnceComplete(int camera) const {
  if (!rig_complete_) return;
  throw std::invalid_argument("camera " + std::to_string(camera) +
                              " first appears when the rig is complete: all cameras must be there "
                              "within a second of the first event, and before that where somebody "
                              "asks for the map");
}

void MappingSession::refuseWithoutNext(int camera) const {
  throw std::invalid_argument("the recording has events of camera " + std::to_string(camera) +
                              " but none of camera " + std::to_string(numCameras()));
}

/// For the cameras before it to appear, as long as they may.
void MappingSession::letWait(CameraPacket packet) {
  const int camera = packet.camera;
  if (rig_complete_ && waiting_.count(camera) != 0) refuseWithoutNext(camera);
  refuseOnceComplete(camera);
  packet.calibration.model.validate();
  if (!packet.events.empty()) {
    const std::int64_t begin_ns = packet.events.front().t_ns + packet.calibration.time_offset_ns;
    if (!waiting_since_ns_) waiting_since_ns_ = begin_ns;
    if (begin_ns - *waiting_since_ns_ > kRigCompletesNs) refuseWithoutNext(camera);
  }
  waiting_[camera].push_back(std::move(packet));
}

/// Adds the camera that comes next, and those after it that wait for it alone, before any of their
/// packets is fed: these may complete the rig. A packet that is refused takes no other with it.
void MappingSession::addCameras(CameraPacket first) {
  refuseOnceComplete(first.camera);
  std::vector<CameraPacket> packets;
  packets.push_back(std::move(first));
  addCamera(packets.front().calibration);
  for (auto next = waiting_.extract(numCameras()); next; next = waiting_.extract(numCameras())) {
    addCamera(next.mapped().front().calibration);
    std::move(next.mapped().begin(), next.mapped().end(), std::back_inserter(packets));
  }
  std::exception_ptr refusal;
  for (CameraPacket& packet : packets) {
    try {
      feed(std::move(packet));
    } catch (const std::invalid_argument&) {
      if (!refusal) refusal = std::current_exception();
    }
  }
  if (refusal) std::rethrow_exception(refusal);
}

void MappingSession::addCamera(const RigCamera& camera) {
  mapper_.addCamera(camera);
  status_.silent_keyframes.push_back(0);
}

void MappingSession::feed(CameraPacket packet) {
  const RigCamera& camera = mapper_.rig().cameras[static_cast<std::size_t>(packet.camera)];
  if (!sameCalibration(camera, packet.calibration)) {
    throw std::invalid_argument("camera " + std::to_string(packet.camera) +
                                ": its calibration or its pose on the rig differs from that of its "
                                "first packet");
  }
  std::optional<TimeSpan> span = status_.events;
  if (!packet.events.empty()) {
    extend(span, packet.events.front().t_ns + camera.time_offset_ns);
    extend(span, packet.events.back().t_ns + camera.time_offset_ns);
  }
  mapper_.addEvents(packet.camera, packet.events);
  if (packet.covered_until_ns) mapper_.coverUntil(packet.camera, *packet.covered_until_ns);
  status_.events = span;
  if (packet.events.empty()) return;
  const std::int64_t begin_ns = packet.events.front().t_ns + camera.time_offset_ns;
  newest_begin_ns_ = std::max(newest_begin_ns_.value_or(begin_ns), begin_ns);
  if (seenFor(kRigCompletesNs)) completeRig();
}

/// Whether a packet began so long after the first event: by then every camera has sent one, however
/// long they are.
bool MappingSession::seenFor(std::int64_t duration_ns) const {
  return newest_begin_ns_ && *newest_begin_ns_ - status_.events->first_ns > duration_ns;
}

/// From now on no camera may come, and those that the options name must be there.
void MappingSession::completeRig() {
  if (rig_complete_) return;
  const int count = numCameras();
  const std::string expected = "a camera of the recording: 0 to " + std::to_string(count - 1);
  for (const int camera : options_.mapper.cameras) {
    requireOption(camera < count, "[rig] cameras", camera, expected);
  }
  const int reference = options_.mapper.keyframe.reference_camera;
  requireOption(count == 0 || reference < count, "[dsi] reference_camera", reference, expected);
  if (count > 0 && setup_.calibration) {
    setup_.calibration->requireCameras(static_cast<std::size_t>(count));
  }
  const std::size_t offsets = options_.rig.time_offsets_ns.size();
  requireOption(count == 0 || offsets == 0 || offsets == static_cast<std::size_t>(count),
                "[rig] time_offsets_s (how many)", offsets,
                "one per camera of the recording: " + std::to_string(count));
  take(pose_choice_.settle());
  rig_complete_ = true;
}

void MappingSession::addPose(const StampedPose& pose, const PoseOrigin& origin,
                             const std::optional<PoseNoise>& noise) {
  take(pose_choice_.add(origin, pose));
  const bool used = !pose_choice_.chosen() || *pose_choice_.chosen() == origin;
  // As of poses, of two with the same time the first stands.
  if (refinement_ && used) noises_[origin].try_emplace(pose.t_ns, noise);
}

/// What the tracker said that the last pose before a time errs by, if it did. Forgets those before
/// it.
std::optional<PoseNoise> MappingSession::noiseAt(std::int64_t t_ns) {
  if (!pose_choice_.chosen()) return std::nullopt;
  auto& noises = noises_[*pose_choice_.chosen()];
  const auto after = noises.upper_bound(t_ns);
  if (after == noises.begin()) return std::nullopt;
  noises.erase(noises.begin(), std::prev(after));
  return noises.begin()->second;
}

void MappingSession::take(const std::vector<StampedPose>& poses) {
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
  // Neither a camera nor a better source of poses is shut out that may still come.
  if (!waiting_.empty() || !pose_choice_.chosen() || !seenFor(kRigCompletesEarlyNs)) return;
  completeRig();
}

void MappingSession::finish() {
  finished_ = true;
  take(pose_choice_.settle());
  mapper_.finish();
  completeRig();
  if (!waiting_.empty()) refuseWithoutNext(waiting_.begin()->first);
}

std::optional<KeyframeDepthMap> MappingSession::next(DsiSink* sink) {
  if (!rig_complete_) return std::nullopt;
  StageTimer timer(status_.seconds);
  std::optional<KeyframeDepthMap> keyframe = mapper_.next(sink, &timer);
  if (keyframe) {
    place(*keyframe);
  } else if (finished_ && refinement_ && !std::exchange(all_refined_, true)) {
    refinement_->finish();
    settle();
  }
  return keyframe;
}

/// Puts a keyframe into the cloud where it stands by now, and others where they stand then.
void MappingSession::place(KeyframeDepthMap& keyframe) {
  const Rigid3 T_odom_ref = keyframe.T_world_ref;
  std::vector<ViewPoint> points = pointsOf(keyframe);
  if (refinement_) {
    // What the map refuses must not be refined either: both number keyframes alike.
    const Rigid3 T_world_ref = refinement_->state().T_world_odom * T_odom_ref;
    cloud_.cloud().requireInsertable(pointsInWorld(points, T_world_ref));
    keyframe.T_world_ref = refinement_->add(keyframe, noiseAt(keyframe.window.t_ref_ns));
  }
  const SecondsScope scope(status_.seconds.map);
  cloud_.insert(std::move(points), keyframe.T_world_ref);
  T_odom_ref_.push_back(T_odom_ref);
  for (const int camera : keyframe.silent_cameras) {
    ++status_.silent_keyframes[static_cast<std::size_t>(camera)];
  }
  // What nobody would see is not worth moving.
  constexpr double kVoxelShare = 0.1;
  if (refinement_) follow(kVoxelShare * options_.cloud.voxel_size_m);
}

/// Puts keyframes that the refinement moved where they stand now; when live, some of them at a
/// time: the mapping goes on.
void MappingSession::follow(double tolerance_m) {
  constexpr std::size_t kMostWhenLive = 16;
  for (const auto& [keyframe, T_world_ref] : refinement_->takeMoved()) {
    cloud_.move(keyframe, T_world_ref);
  }
  const bool some = options_.refinement.background && tolerance_m > 0;
  cloud_.applyPending(tolerance_m, some ? kMostWhenLive : std::numeric_limits<std::size_t>::max());
}

void MappingSession::settle() {
  if (!refinement_) return;
  const SecondsScope scope(status_.seconds.map);
  follow(0);
}

std::vector<ViewPoint> MappingSession::pointsOf(const KeyframeDepthMap& keyframe) const {
  return options_.late_fusion ? lateFusionPoints(keyframe) : viewPoints(keyframe);
}

SessionStatus MappingSession::status() const {
  SessionStatus status = status_;
  status.counts = mapper_.counts();
  status.pose_source = pose_choice_.chosen();
  status.other_poses = pose_choice_.unused();
  status.rig = mapper_.rig();
  if (refinement_) {
    status.refinement = refinement_->state();
    status.seconds.refine = status.refinement->seconds;
  }
  return status;
}

std::string whyNoKeyframe(const SessionStatus& status, const FusionMapperOptions& options) {
  if (!status.events) return "the recording has no events";
  if (!status.poses) {
    std::string why = "the recording has no poses";
    const char* before = " of the source that [rig] pose_source says, but of ";
    for (const auto& [source, count] : status.other_poses) {
      why += std::exchange(before, ", ") + asText(source);
    }
    return why;
  }
  const std::string spans =
      "the events span " + asText(*status.events) + ", the poses " + asText(*status.poses);
  const std::int64_t first_ns = std::max(status.events->first_ns, status.poses->first_ns);
  const std::int64_t last_ns = std::min(status.events->last_ns, status.poses->last_ns);
  if (first_ns > last_ns) {
    return spans + ": they miss each other by " + formatSeconds(first_ns - last_ns) + " s";
  }
  const EventCounts counts = status.counts.total();
  if (counts.filtered > 0 && counts.used == 0 && counts.filtered + counts.dropped == counts.read) {
    return "the filters took all " + std::to_string(counts.filtered) +
           " events of the selected cameras for noise: [filter] is too strict for this recording";
  }
  const bool saw_nothing =
      status.counts.keyframes_without_pose == 0 && status.counts.windows_without_events > 0;
  if (options.only_window) {
    const Window& window = *options.only_window;
    const std::string stretch = "the window " + asText({window.t0_ns, window.t1_ns});
    return saw_nothing ? "the selected cameras have no event in " + stretch + "; " + spans
                       : "there is no pose at the reference time " +
                             formatSeconds(window.t_ref_ns) + " s of " + stretch + "; " + spans;
  }
  if (saw_nothing) {
    return "the selected cameras have no event in any window that was full: " + spans;
  }
  if (status.counts.keyframes_without_pose > 0) {
    return std::to_string(status.counts.keyframes_without_pose) +
           " windows were full, but had no pose at their reference times: poses are more than "
           "max_pose_gap_s apart there";
  }
  return "no window of " + fullWindow(options.keyframes) + " was full: " + spans + ", " +
         formatSeconds(last_ns - first_ns) + " s of them together";
}

}  // namespace efm
