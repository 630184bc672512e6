// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/session/mapper_core.h"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <stdexcept>
#include <utility>

#include "mapping/geometry/timestamp.h"
#include "plugin/recordings/streams/pose_conflict.h"
#include "plugin/session/health_checks.h"

namespace efm {
namespace {

/// Snapshots of the map may take 1 / this of the time.
constexpr int kMapCostDivisor = 20;

std::string errorText() {
  try {
    throw;
  } catch (const std::exception& error) {
    return error.what();
  } catch (...) {
    return "an exception of another type";
  }
}

std::vector<float> depthsIn(const cv::Mat1f& depth) {
  std::vector<float> depths_m;
  std::copy_if(depth.begin(), depth.end(), std::back_inserter(depths_m),
               [](float depth_m) { return depth_m > 0; });
  return depths_m;
}

/// Returns why an ended input made no keyframe. @return std::nullopt if it made one.
std::optional<Warning> noKeyframe(const SessionStatus& state, const FusionMapperOptions& options) {
  if (state.counts.keyframes > 0) return std::nullopt;
  return Warning{"no-keyframe",
                 fmt::format("there is no keyframe: {}", whyNoKeyframe(state, options).what())};
}

}  // namespace

MapperCore::MapperCore(const EventFusionOptions& options, Callbacks callbacks,
                       const std::vector<StoredKeyframe>& earlier)
    : all_options_(options),
      checks_(options.checks),
      callbacks_(std::move(callbacks)),
      setup_(
          std::make_shared<RigSetup>(readRigSetup(options.rig.calibration, options.rig.hand_eye))),
      statistics_(statisticsOptions(options)),
      session_(options) {
  for (const StoredKeyframe& keyframe : earlier) {
    session_.insertEarlier(pointsInWorld(*keyframe.points, keyframe.T_world_ref),
                           keyframe.T_world_ref);
    keep(keyframe);
    forgetOldest();
  }
  if (!options_.enabled) return;
  queue_ = std::make_unique<InputQueue>(options_);
  status_ = session_.status();
  used_options_ = session_.usedOptions();
  used_cloud_ = session_.cloudOptions();
  map_ = makeSnapshot(true);
  thread_ = std::thread([this] {  // waits: no input before the constructor returns
    worker_ = std::this_thread::get_id();
    run();
    worker_ = std::thread::id();
    const auto last = std::move(self_);  // may destroy this
  });
}

std::shared_ptr<MapperCore> MapperCore::make(const EventFusionOptions& options, Callbacks callbacks,
                                             const std::vector<StoredKeyframe>& earlier) {
  const auto mapper = std::make_shared<MapperCore>(options, std::move(callbacks), earlier);
  if (mapper->queue_) mapper->self_ = mapper;
  return {mapper.get(), [mapper](MapperCore*) {
            mapper->stop();
            if (mapper->runsHere()) mapper->thread_.detach();
          }};
}

MapperCore::~MapperCore() {
  if (!runsHere()) stop();
}

int MapperCore::addCamera(const RigCamera& camera) {
  camera.validate();
  const std::lock_guard<std::mutex> lock(cameras_mutex_);
  if (rig_is_fixed_) throw std::logic_error("a camera was added after the first events");
  given_rig_.cameras.push_back(camera);
  return static_cast<int>(given_rig_.cameras.size()) - 1;
}

void MapperCore::addCameras(const Rig& rig) {
  const std::lock_guard<std::mutex> lock(cameras_mutex_);
  if (!given_rig_.cameras.empty()) {
    const std::vector<RigCamera>& given = given_rig_.cameras;
    if (!std::equal(given.begin(), given.end(), rig.cameras.begin(), rig.cameras.end(),
                    [](const RigCamera& a, const RigCamera& b) { return isSame(a, b); })) {
      throw std::invalid_argument("the cameras differ from those that were added before");
    }
  }
  if (!rig_is_fixed_) fixRig(rig);
}

/// Gives the cameras to the session. @throws std::invalid_argument if they do not fit the options.
void MapperCore::fixRig(const Rig& given) {
  const Rig rig = calibrated(given, *setup_, all_options_.rig.time_offsets_ns);
  requireMappable(rig, all_options_);
  if (queue_) {
    queue_->add(rig);
  } else {
    Batch batch;
    batch.rig = rig;
    std::exception_ptr error;
    feed(std::move(batch), error);
    if (error) std::rethrow_exception(error);
    for (const RigCamera& camera : rig.cameras) {
      intakes_.emplace_back(static_cast<int>(intakes_.size()), camera);
    }
  }
  given_rig_ = given;
  rig_is_fixed_ = true;
  const std::lock_guard<std::mutex> lock(statistics_mutex_);
  statistics_.setCameras(rig, {});
}

void MapperCore::addEvents(int camera, std::vector<Event> events,
                           std::optional<std::int64_t> complete_until_ns) {
  const auto index = static_cast<std::size_t>(camera);
  EventPacket packet{camera, {}, complete_until_ns};
  Batch batch;
  {
    const std::lock_guard<std::mutex> lock(cameras_mutex_);
    if (index >= given_rig_.cameras.size()) {
      throw std::invalid_argument(
          fmt::format("events of camera {}: there are {} cameras: expected a camera that was added",
                      camera, given_rig_.cameras.size()));
    }
    if (!rig_is_fixed_) fixRig(given_rig_);
    if (queue_) return queue_->add(camera, std::move(events), complete_until_ns);
    EventIntake& intake = intakes_[index];
    if (pose_times_) intake.expectPoses(pose_times_->first_ns, pose_times_->last_ns);
    packet.events = intake.add(std::move(events));
    if (complete_until_ns) {
      packet.complete_until_ns = std::min(*complete_until_ns, intake.waitsSinceNs());
    }
    noteEvents(packet, batch);
    const std::lock_guard<std::mutex> statistics_lock(statistics_mutex_);
    statistics_.addEvents(packet);
  }
  batch.packets.push_back({std::move(packet)});
  workHere(std::move(batch));
}

/// Adds the poses to the batch that the events of a packet confirm.
void MapperCore::noteEvents(const EventPacket& packet, Batch& batch) {
  if (packet.events.empty()) return;
  const std::int64_t offset_ns = intakes_[static_cast<std::size_t>(packet.camera)].offsetNs();
  addRight(pose_intake_.noteEvents(trajectoryTime(packet.events.back().t_ns, offset_ns)), batch);
}

void MapperCore::addRight(std::vector<PoseSample> poses, Batch& batch) {
  for (const PoseSample& pose : poses) extend(pose_times_, pose.t_ns);
  batch.poses = std::move(poses);
}

std::vector<Warning> MapperCore::warnings() {
  bool ended = false;
  PixelSizes pixels;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    ended = ended_;
    pixels = pixel_sizes_;
  }
  const FusionMapperOptions options = usedOptions();
  const SessionStatus state = status();
  RecordingStatistics statistics;
  {
    const std::lock_guard<std::mutex> lock(statistics_mutex_);
    statistics = statistics_;
  }
  Findings findings{statistics, {}};
  {
    const std::lock_guard<std::mutex> lock(cameras_mutex_);
    for (const EventIntake& intake : intakes_) {
      if (findings.read.first_skipped.empty()) findings.read.first_skipped = intake.firstWrong();
      findings.read.skipped_events += intake.wrongEvents();
    }
    if (pose_intake_.wrongPoses() > 0) {
      findings.read.warnings.push_back(
          skippedPoses(pose_intake_.wrongPoses(), pose_intake_.firstWrong()));
    }
  }
  findings.use(options.keyframe.planes, state.chosen);
  findings.max_pose_gap_s = options.trajectory.max_pose_gap_s;
  findings.checks = checks_;
  findings.session = &state;
  findings.options = &options;
  findings.voxel_size_m = cloudOptions().voxel_size_m;
  if (ended) findings.pixels = &pixels;
  std::vector<Warning> warnings = warningsOf(findings);
  double reach_m = 4 * options.keyframe.planes.max_depth_m;  // of points around the keyframes
  const auto map = newest(false);
  for (const StampedPose& pose : map->trajectory) {
    reach_m = std::max(reach_m, pose.T_world_rig.translation.cwiseAbs().maxCoeff() +
                                    4 * options.keyframe.planes.max_depth_m);
  }
  if (ended && coarseStepAt(reach_m, findings.voxel_size_m)) {  // only then is the map exported
    if (auto far = farPointsWarning(*newest(true)->points, findings.voxel_size_m)) {
      warnings.push_back(std::move(*far));
    }
  }
  const auto no_keyframe = ended ? noKeyframe(state, options) : std::nullopt;
  if (no_keyframe) warnings.insert(warnings.begin(), *no_keyframe);
  return warnings;
}

FusionMapperOptions MapperCore::usedOptions() const {
  if (queue_) {
    const std::lock_guard<std::mutex> lock(mutex_);
    return used_options_;
  }
  const std::lock_guard<TurnMutex> lock(session_mutex_);
  return session_.usedOptions();
}

GlobalCloudOptions MapperCore::cloudOptions() const {
  if (queue_) {
    const std::lock_guard<std::mutex> lock(mutex_);
    return used_cloud_;
  }
  const std::lock_guard<TurnMutex> lock(session_mutex_);
  return session_.cloudOptions();
}

/// Warns of an input that made no keyframe or whose poses blur the events, and lets `warnings` say
/// so from now on.
void MapperCore::noteEnd(std::exception_ptr& error) {
  if (const auto warning = noKeyframe(status(), usedOptions())) {
    warn(warning->name + ": " + warning->text, error);
  }
  for (const Warning& warning : warnings()) {
    if (warning.name == "poses-blur" || warning.name == "far-coordinates" ||
        warning.name == "voxel-size" || warning.name == "skipped-events" ||
        warning.name == "skipped-poses")
      warn(warning.name + ": " + warning.text, error);
  }
  const MapQuality quality = status().quality;
  if (!callbacks_.info || quality.word == QualityWord::kUnknown) return;
  callBack(error, "the callback of the log",
           [&] { callbacks_.info("quality: " + textOf(quality)); });
}

void MapperCore::add(Sample sample) {
  auto* const packet = std::get_if<EventPacket>(&sample);
  auto* const pose = std::get_if<PoseSample>(&sample);
  Batch batch;
  if (packet) {
    const std::lock_guard<std::mutex> lock(cameras_mutex_);
    if (!rig_is_fixed_ || std::size_t(packet->camera) >= given_rig_.cameras.size()) {
      throw std::invalid_argument(fmt::format(
          "a packet of camera {}: expected addCameras(recording.rig()) before it", packet->camera));
    }
    if (!queue_) noteEvents(*packet, batch);
  }
  if (pose && setup_->T_body_rig) pose->T_body_rig = *setup_->T_body_rig;
  if (pose && !queue_) {
    const std::lock_guard<std::mutex> lock(cameras_mutex_);
    addRight(pose_intake_.add(std::move(*pose)), batch);
  }
  if (queue_) {
    if (packet) queue_->add(std::move(*packet));
    if (pose) queue_->add(std::move(*pose));
    return;
  }
  if (packet) batch.packets.push_back({std::move(*packet)});
  workHere(std::move(batch));
}

void MapperCore::skip(int camera, const std::vector<Event>& events) {
  if (queue_) return queue_->skip(camera, events);
  if (events.empty()) return;
  Batch batch;
  batch.packets.push_back(skippedPacket(camera, events));
  {
    const std::lock_guard<TurnMutex> lock(session_mutex_);
    paused_events_[camera] += events.size();
  }
  workHere(std::move(batch));
}

void MapperCore::finish() {
  const auto kept = weak_from_this().lock();
  if (!queue_) {
    Batch end;
    end.ended = true;
    {
      const std::lock_guard<std::mutex> lock(cameras_mutex_);
      addRight(pose_intake_.finish(), end);
      for (EventIntake& intake : intakes_) {
        const auto camera = static_cast<int>(&intake - intakes_.data());
        if (pose_times_) intake.expectPoses(pose_times_->first_ns, pose_times_->last_ns);
        EventPacket& rest = end.packets.emplace_back(QueuedPacket{{camera, intake.finish()}});
        const std::lock_guard<std::mutex> statistics_lock(statistics_mutex_);
        statistics_.addEvents(rest);
      }
    }
    workHere(std::move(end));
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      if (std::exchange(ended_, true)) return;
    }
    std::exception_ptr error;
    noteEnd(error);
    if (error) std::rethrow_exception(error);
    return;
  }
  if (runsHere()) throw std::logic_error("the mapping cannot be finished from its own callback");
  queue_->end();
  std::unique_lock<std::mutex> lock(mutex_);
  ended_changed_.wait(lock, [this] { return ended_; });
  if (end_error_) std::rethrow_exception(std::exchange(end_error_, nullptr));
}

void MapperCore::stop() {
  if (!queue_) {
    const std::lock_guard<TurnMutex> lock(session_mutex_);  // waits for the current keyframe
    stopped_ = true;
    return;
  }
  stopped_ = true;
  queue_->stop();
  if (runsHere()) return;
  const std::lock_guard<std::mutex> lock(join_mutex_);
  if (thread_.joinable()) thread_.join();
}

/// Feeds and maps a batch in the caller's thread.
void MapperCore::workHere(Batch batch) {
  const auto kept = weak_from_this().lock();  // a callback may drop the last reference
  std::exception_ptr error;
  feed(std::move(batch), error);
  while (mapNext(error)) {  // earlier samples are mapped even if one is rejected
  }
  if (error) std::rethrow_exception(error);
}

void MapperCore::run() {
  std::exception_ptr error;
  for (bool goes_on = true; goes_on;) {
    attempt(error, Fault::kMapping, "the input", [&] { goes_on = runOnce(); });  // may lack memory
  }
  endRun(nullptr);  // if stopped, nobody waits for the end
}

/// @return true if more input may come.
bool MapperCore::runOnce() {
  std::exception_ptr error;
  // A delayed snapshot is made when its time has come.
  Batch batch =
      map_changed_ ? queue_->wait(map_renewed_ + kMapCostDivisor * map_cost_) : queue_->wait();
  do {
    if (stopped_) return false;
    if (batch.ended) {
      std::exception_ptr end_error;
      feed(std::move(batch), end_error);
      while (mapNext(error) && !stopped_) {
      }
      publishMap(true, error);
      publishState(error);
      warnOfLosses();
      noteEnd(error);
      endRun(end_error);
      return false;
    }
    feed(std::move(batch), error);
    warnOfLosses();
    if (!mapNext(error)) break;
    batch = queue_->take();
  } while (true);
  publishMap(false, error);
  return true;
}

void MapperCore::endRun(std::exception_ptr error) {
  const std::lock_guard<std::mutex> lock(mutex_);
  if (std::exchange(ended_, true)) return;
  end_error_ = std::move(error);
  ended_changed_.notify_all();
}

/// Feeds the session.
/// @param error receives the first error; in live operation only an error of the end, because
/// `attempt` counts and logs the others.
void MapperCore::feed(Batch batch, std::exception_ptr& error) {
  std::exception_ptr ignored;
  std::exception_ptr& of_input = queue_ ? ignored : error;
  {
    const std::lock_guard<TurnMutex> lock(session_mutex_);
    if (finished_ && !queue_ && !batch.ended) {
      throw std::logic_error("input after the end: `finish` was called");
    }
    if (batch.rig) {
      attempt(of_input, Fault::kMapping, "the cameras", [&] { session_.addCameras(*batch.rig); });
    }
    for (const PoseSample& pose : batch.poses) {
      attempt(of_input, Fault::kPose, "", [&] {
        session_.addPose(pose);
        const std::lock_guard<std::mutex> poses_lock(statistics_mutex_);
        statistics_.addPose(pose);
      });
    }
    for (const auto& missing : batch.missing) {
      attempt(of_input, Fault::kMapping, "the choice of options",
              [&] { session_.noteMissing(missing.first, missing.second); });
    }
    for (QueuedPacket& packet : batch.packets) {
      attempt(of_input, Fault::kEvents, "", [&] {
        if (packet.skipped_until_ns) {
          session_.noteMissing(packet.camera, {*packet.skipped_until_ns, DropReason::kPaused});
          return;
        }
        session_.addEvents(std::move(packet));
      });
    }
    if (batch.ended && !std::exchange(finished_, true)) {
      attempt(error, Fault::kMapping, "the end of the input", [&] { session_.finish(); });
    }
  }
  publishState(of_input);
}

/// @return true if it made a keyframe, or dropped a window in live operation.
bool MapperCore::mapNext(std::exception_ptr& error) {
  std::optional<KeyframeDepthMap> keyframe;
  std::vector<std::string> warnings;
  bool goes_on = false;
  {
    const std::lock_guard<TurnMutex> lock(session_mutex_);
    // Within a callback in playback, the caller of the callback maps.
    if (stopped_ || delivering_.count(std::this_thread::get_id()) != 0) return false;
    if (queue_) {  // old windows are dropped for the newest input
      attempt(error, Fault::kMapping, "the input that waits", [&] {
        session_.limitHeld(options_.queueEvents() - static_cast<double>(queue_->queuedEvents()));
      });
    }
    DsiSink* sink = nullptr;
    ProcessorClock clock;
    {
      const std::lock_guard<std::mutex> settings(mutex_);
      sink = sink_;
      clock = clock_;
    }
    const std::size_t kept = map_so_far_.trajectory.size();
    const std::size_t kept_keyframes = map_so_far_.keyframes.size();
    const auto store = [this](const KeyframeDepthMap& made, const std::vector<ViewPoint>& points) {
      keep({made.window.t_ref_ns, made.T_world_ref,
            std::make_shared<const std::vector<ViewPoint>>(points)});
    };
    const bool mapped = attempt(error, Fault::kMapping, "a keyframe",
                                [&] { keyframe = session_.next(sink, clock, store); });
    if (!mapped) {  // the session does not have this keyframe
      map_so_far_.trajectory.resize(kept);
      map_so_far_.tracker_trajectory.resize(std::min(map_so_far_.tracker_trajectory.size(), kept));
      map_so_far_.keyframes.resize(std::min(map_so_far_.keyframes.size(), kept_keyframes));
      goes_on = queue_ && session_.dropFailedWindow();
    }
    if (keyframe) {
      goes_on = true;
      map_changed_ = true;
      attempt(error, Fault::kMapping, "a warning",
              [&] { warnings = warningsOfSilence(*keyframe); });
      forgetOldest();
      const std::lock_guard<std::mutex> published(mutex_);
      newest_depth_ = keyframe->map.depth;
      pixel_sizes_.add(depthsIn(keyframe->map.depth), keyframe->view.fx);
      newest_planes_ = session_.chosen().planes;
    }
  }
  if (keyframe && queue_) publishMap(false, error);
  publishState(error);
  for (const std::string& text : warnings) warn(text, error);
  if (keyframe && callbacks_.on_keyframe) {
    callBack(error, "the callback of a keyframe", [&] { callbacks_.on_keyframe(*keyframe); });
  }
  return goes_on;
}

/// Returns at most one warning per camera. The status counts the keyframes without its events.
std::vector<std::string> MapperCore::warningsOfSilence(const KeyframeDepthMap& keyframe) {
  std::vector<std::string> warnings;
  for (const int camera : keyframe.silent_cameras) {
    if (!silent_cameras_.insert(camera).second) continue;
    warnings.push_back(fmt::format("camera {} had no event for the keyframe at {} s", camera,
                                   formatSeconds(keyframe.window.t_ref_ns)));
  }
  return warnings;
}

/// Adds a keyframe to the map so far. If memory runs out, the caller removes the keyframe.
void MapperCore::keep(StoredKeyframe keyframe) {
  const StampedPose pose{keyframe.t_ref_ns, keyframe.T_world_ref};
  map_so_far_.trajectory.push_back(pose);
  map_so_far_.tracker_trajectory.push_back(pose);
  map_so_far_.keyframes.push_back(std::move(keyframe));
}

/// Forgets the cloud of the oldest keyframe if there are too many, in live operation.
void MapperCore::forgetOldest() {
  std::vector<StoredKeyframe>& keyframes = map_so_far_.keyframes;
  if (!options_.enabled || keyframes.size() <= std::size_t(options_.max_keyframes)) return;
  keyframes.erase(keyframes.begin());
}

/// Makes a snapshot. Moves cloud and keyframes to their refined poses before, so that they agree.
std::shared_ptr<MapSnapshot> MapperCore::makeSnapshot(bool with_points) {
  session_.applyPending();
  const std::vector<Rigid3>& T_world_ref = session_.T_world_ref();
  std::vector<StampedPose>& trajectory = map_so_far_.trajectory;
  std::vector<StoredKeyframe>& keyframes = map_so_far_.keyframes;
  const std::size_t earlier = trajectory.size() - T_world_ref.size();
  const std::size_t forgotten = trajectory.size() - keyframes.size();
  for (std::size_t i = earlier; i < trajectory.size(); ++i) {
    if (isSame(trajectory[i].T_world_rig, T_world_ref[i - earlier])) continue;
    trajectory[i].T_world_rig = T_world_ref[i - earlier];
    if (i >= forgotten) keyframes[i - forgotten].T_world_ref = T_world_ref[i - earlier];
  }
  for (const std::size_t left_out : session_.leftOut()) {
    if (earlier + left_out < forgotten) continue;
    keyframes[earlier + left_out - forgotten].points =
        std::make_shared<const std::vector<ViewPoint>>();
  }
  auto map = std::make_shared<MapSnapshot>(map_so_far_);
  if (with_points) map->points = session_.cloud().points();
  return map;
}

std::shared_ptr<const MapSnapshot> MapperCore::newest(bool with_points) {
  if (queue_) {
    const std::lock_guard<std::mutex> lock(mutex_);
    return map_;
  }
  const std::lock_guard<TurnMutex> lock(session_mutex_);
  return makeSnapshot(with_points);
}

/// Renews the snapshot in live operation, unless this would take too much of the time.
void MapperCore::publishMap(bool at_once, std::exception_ptr& error) {
  const Clock::time_point begin = Clock::now();
  const bool is_due = map_changed_ && begin - map_renewed_ >= kMapCostDivisor * map_cost_;
  if (!is_due && !at_once) return;
  std::shared_ptr<const MapSnapshot> made;
  const bool done = attempt(error, Fault::kMapping, "the snapshot of the map", [&] {
    const std::lock_guard<TurnMutex> lock(session_mutex_);
    made = makeSnapshot(true);
  });
  map_renewed_ = Clock::now();
  map_cost_ = map_renewed_ - begin;
  if (!done) return;  // the next try costs as much
  map_changed_ = false;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    map_ = made;
  }
  if (!callbacks_.on_map) return;
  callBack(error, "the callback of the map", [&] { callbacks_.on_map(made); });
}

/// Logs a choice of options. In live operation it renews the state and logs failed refinements; in
/// playback the caller gets these errors.
void MapperCore::publishState(std::exception_ptr& error) {
  SessionStatus status;
  FusionMapperOptions used;
  GlobalCloudOptions used_cloud;
  bool is_new_choice = false;
  bool is_first_blur = false;
  {
    const std::lock_guard<TurnMutex> lock(session_mutex_);
    const std::uint64_t choices = session_.chosen().choices;
    is_new_choice = std::exchange(logged_choices_, choices) != choices;
    const bool blurs = session_.correctedKeyframes() > 0;
    is_first_blur = blurs && !std::exchange(blur_logged_, true);
    if (!queue_ && !is_new_choice && !is_first_blur) return;
    status = session_.status();
    used = session_.usedOptions();
    used_cloud = session_.cloudOptions();
  }
  if (is_first_blur) {
    callBack(error, "the callback of the log", [&] {
      if (callbacks_.info) callbacks_.info(motionText(status, used));
    });
  }
  if (is_new_choice) {
    callBack(error, "the callback of the log", [&] {
      if (callbacks_.info) {
        callbacks_.info(choiceText(status));
        for (const Warning& note : status.pose_notes) callbacks_.info(note.name + ": " + note.text);
      }
      if (!callbacks_.warn) return;
      std::vector<Warning> warnings = status.pose_warnings;
      if (status.scene_unknown && status.events && status.poses) {
        warnings.push_back(noSceneWarning());
      }
      for (const Warning& warning : warnings) {
        callbacks_.warn(warning.name + ": " + warning.text);
      }
    });
  }
  if (!queue_) return;
  std::string failure;
  if (status.refinement && status.refinement->failures > warned_failures_) {
    warned_failures_ = status.refinement->failures;
    failure = "refinement: " + status.refinement->last_error;
  }
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    status_ = std::move(status);
    used_options_ = std::move(used);
    used_cloud_ = used_cloud;
  }
  if (!failure.empty()) warn(failure, error);
}

SessionStatus MapperCore::status() const {
  if (!queue_) {
    const std::lock_guard<TurnMutex> lock(session_mutex_);
    SessionStatus status = session_.status();
    status.paused_events = paused_events_;
    return status;
  }
  std::map<int, QueueCounts> cameras = queue_->counts();
  const std::uint64_t rejected_poses = queue_->rejectedPoses();
  const std::lock_guard<std::mutex> lock(mutex_);
  SessionStatus status = status_;
  LiveStatus& live = *status.live;
  for (const auto& [camera, counts] : live.cameras) cameras[camera].lost = counts.lost;
  live.cameras = std::move(cameras);
  live.rejected_poses += live_.rejected_poses + rejected_poses;
  live.errors = live_.errors;
  live.last_error = live_.last_error;
  return status;
}

std::size_t MapperCore::numKeyframes() const {
  if (queue_) {
    const std::lock_guard<std::mutex> lock(mutex_);
    return map_->keyframes.size();
  }
  const std::lock_guard<TurnMutex> lock(session_mutex_);
  return map_so_far_.keyframes.size();
}

std::pair<cv::Mat1f, DepthPlanesOptions> MapperCore::newestDepth() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return {newest_depth_, newest_planes_};
}

void MapperCore::setSink(DsiSink* sink) {
  const std::lock_guard<std::mutex> lock(mutex_);
  sink_ = sink;
}

void MapperCore::setFacts(QualityFacts facts) {
  const std::lock_guard<TurnMutex> lock(session_mutex_);
  session_.setFacts(std::move(facts));
}

void MapperCore::setClock(ProcessorClock clock) {
  const std::lock_guard<std::mutex> lock(mutex_);
  clock_ = std::move(clock);
}

/// Runs a step. Its exception goes to the caller in playback, and is counted in live operation.
/// @param error keeps the first exception.
template <typename Step>
bool MapperCore::attempt(std::exception_ptr& error, Fault fault, const char* doing,
                         const Step& step) {
  try {
    step();
    return true;
  } catch (...) {
    if (!error) error = std::current_exception();
    if (queue_) noteError(doing, fault);
    return false;
  }
}

/// Calls the host without a lock that another thread needs.
template <typename Call>
void MapperCore::callBack(std::exception_ptr& error, const char* name, const Call& call) {
  if (stopped_) return;
  if (queue_) {
    attempt(error, Fault::kCallback, name, call);
    return;
  }
  const auto thread = std::this_thread::get_id();
  bool is_outer = false;
  attempt(error, Fault::kCallback, name, [&] {
    {
      const std::lock_guard<TurnMutex> lock(session_mutex_);
      is_outer = delivering_.insert(thread).second;
    }
    call();
  });
  const std::lock_guard<TurnMutex> lock(session_mutex_);
  if (is_outer) delivering_.erase(thread);
}

/// Writes a line to the host's log.
void MapperCore::warn(const std::string& text, std::exception_ptr& error) {
  if (!callbacks_.warn) return;
  callBack(error, "the callback of the log", [&] { callbacks_.warn(text); });
}

/// Counts an exception, within its handler. Throws nothing: nobody catches in the thread.
void MapperCore::noteError(const char* doing, Fault fault) noexcept {
  const bool is_input = fault == Fault::kEvents || fault == Fault::kPose;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (!is_input) ++live_.errors;
    if (fault == Fault::kPose) ++live_.rejected_poses;
  }
  try {
    const std::string text = errorText();
    bool is_new = false;
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      is_new = live_.last_error != text;
      live_.last_error = text;
    }
    // A failing callback is logged once, rejected events once a second, rejected poses never.
    const Clock::time_point now = Clock::now();
    if (fault == Fault::kCallback) is_new = logged_callbacks_.insert(doing).second;
    if (fault == Fault::kEvents && now - rejection_logged_ < std::chrono::seconds(1)) return;
    if (!is_new || fault == Fault::kPose) return;
    if (is_input) rejection_logged_ = now;
    std::exception_ptr ignored;
    warn(is_input ? text : std::string(doing) + ": " + text, ignored);
  } catch (...) {  // no memory: the error is counted already
  }
}

/// Warns of lost events and dropped windows, at most once a second.
void MapperCore::warnOfLosses() {
  const Clock::time_point now = Clock::now();
  if (now - warned_ < std::chrono::seconds(1)) return;
  std::uint64_t losses = 0;
  std::string text;
  const SessionStatus status = this->status();
  for (const auto& [camera, counts] : status.live->cameras) {
    losses += counts.losses();
    text += fmt::format("; camera {}: ", camera);
    for (const EventFate fate :
         {EventFate::kQueueFull, EventFate::kSubsampled, EventFate::kRejected}) {
      text += fmt::format("{} {}, ", counts.fates[fate], rowOf(fate).text);
    }
    text += fmt::format("{} lost afterwards, of {} events", counts.lost, counts.received);
  }
  const DroppedWindows& dropped = status.counts.dropped_windows;
  if (losses == warned_losses_ && dropped.total() == warned_dropped_windows_) return;
  warned_ = now;
  warned_losses_ = losses;
  warned_dropped_windows_ = dropped.total();
  std::exception_ptr ignored;
  warn(fmt::format("so far {}{}", asText(dropped), text), ignored);
}

}  // namespace efm
