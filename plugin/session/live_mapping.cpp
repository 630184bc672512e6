// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/session/live_mapping.h"

#include <fmt/format.h>

#include <algorithm>
#include <stdexcept>
#include <utility>

#include "mapping/geometry/timestamp.h"

namespace efm {
namespace {

using Clock = std::chrono::steady_clock;

/// The snapshot of the map may take this part of the time.
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

}  // namespace

LiveMapping::LiveMapping(const EventFusionOptions& options, std::vector<StoredKeyframe> earlier,
                         Callbacks callbacks)
    : options_(options.live),
      callbacks_(std::move(callbacks)),
      queue_(options.live),
      session_(std::make_unique<MappingSession>(options)) {
  T_body_rig_ = session_->setup().T_body_rig;
  for (StoredKeyframe& keyframe : earlier) {
    session_->insertEarlier(worldPointsOf(keyframe), keyframe.T_world_ref);
    keep(std::move(keyframe));
    forgetOldest();
  }
  publishMap(true);
  publishState();
  thread_ = std::thread([this] {
    run();
    const auto last = std::move(alone_);
  });
}

LiveMapping::~LiveMapping() { LiveMapping::stop(); }

void LiveMapping::stop() {
  queue_.stop();
  if (runsHere()) {
    alone_ = shared_from_this();
    thread_.detach();
  } else if (thread_.joinable()) {
    thread_.join();
  }
}

void LiveMapping::run() {
  bool goes_on = true;
  while (goes_on) {
    try {
      goes_on = runOnce();
    } catch (...) {  // no memory
      noteError("the input", Fault::kMapping);
    }
  }
  const std::lock_guard<std::mutex> lock(mutex_);  // stopped: nobody waits for the end any more
  finished_ = true;
  finished_changed_.notify_all();
}

/// @return whether more may come.
bool LiveMapping::runOnce() {
  // A snapshot that was put off is made as soon as it may be.
  bool goes_on =
      feed(map_changed_ ? queue_.wait(map_renewed_ + kMapCostDivisor * map_cost_) : queue_.wait());
  while (mapNext()) {
    const bool more = feed(queue_.take());
    goes_on = goes_on && more;
    if (!more) break;
  }
  if (goes_on) publishMap(false);
  warnOfLosses();
  return goes_on;
}

/// @return whether more may come.
bool LiveMapping::feed(InputQueue::Batch batch) {
  if (batch.stopped) return false;
  for (const QueuedPose& pose : batch.poses) {
    try {
      session_->addPose(pose.pose, pose.source, pose.noise);
    } catch (...) {
      const std::lock_guard<std::mutex> lock(mutex_);
      ++live_.refused_poses;
      live_.last_error = errorText();
    }
  }
  chooseBefore(batch);
  for (const auto& [camera, missing] : batch.missing) session_->noteMissing(camera, missing);
  for (EventPacket& packet : batch.packets) {
    try {
      session_->addEvents(std::move(packet));
    } catch (...) {  // refused, or no memory
      noteError("", Fault::kInput);
    }
  }
  publishState();
  if (!batch.ended) return true;
  std::exception_ptr error;
  try {
    session_->finish();
  } catch (...) {
    error = std::current_exception();
    noteError("the end of the input", Fault::kMapping);
  }
  while (mapNext()) {
    if (queue_.take().stopped) break;
  }
  publishMap(true);
  publishState();
  const std::lock_guard<std::mutex> lock(mutex_);
  finished_ = true;
  finish_error_ = error;
  finished_changed_.notify_all();
  return false;
}

/// The window that automatic options are chosen from is not given up before the choice.
void LiveMapping::chooseBefore(const InputQueue::Batch& batch) {
  constexpr double kEnoughS = 0.2;
  const bool loses = std::any_of(
      batch.missing.begin(), batch.missing.end(),
      [](const auto& missing) { return missing.second.reason == &WindowsGivenUp::overload; });
  try {
    if (loses) session_->chooseFromSoFar(kEnoughS);
  } catch (...) {
    noteError("the choice of options", Fault::kMapping);
  }
}

/// @return whether it made a keyframe or gave one up.
bool LiveMapping::mapNext() {
  DsiSink* sink = nullptr;
  ProcessorClock clock;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    sink = sink_;
    clock = clock_;
  }
  std::optional<KeyframeDepthMap> keyframe;
  const std::size_t kept = next_map_.trajectory.size();
  const std::size_t kept_keyframes = next_map_.keyframes.size();
  try {
    giveUpExcess();
  } catch (...) {
    noteError("the input that waits", Fault::kMapping);
  }
  try {
    keyframe = session_->next(sink, clock, [this](const KeyframeDepthMap& made) {
      keep({made.window.t_ref_ns, made.T_world_ref,
            std::make_shared<std::vector<ViewPoint>>(session_->pointsOf(made))});
    });
  } catch (...) {
    // The session does not have this keyframe.
    next_map_.trajectory.resize(kept);
    next_map_.keyframes.resize(std::min(next_map_.keyframes.size(), kept_keyframes));
    noteError("a keyframe", Fault::kMapping);
    return session_->giveUpFailed();
  }
  if (!keyframe) return false;
  forgetOldest();
  map_changed_ = true;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    live_.failing = false;
    newest_depth_ = keyframe->map.depth;
    planes_ = session_->planes();
  }
  publishMap(false);
  publishState();
  if (callbacks_.on_keyframe) {
    callBack("the callback of a keyframe", [&] { callbacks_.on_keyframe(*keyframe); });
  }
  return true;
}

/// Newest wins: input that waits is bounded.
void LiveMapping::giveUpExcess() {
  const auto is_excess = [this] {
    const std::uint64_t events = session_->heldEvents() + queue_.queuedEvents();
    return static_cast<double>(events) > options_.queueEvents();
  };
  if (is_excess() && session_->chooseFromSoFar(0)) return;
  while (is_excess() && session_->giveUpOldestWindow()) {
  }
  // No window can be mapped, so none can be given up: it is too large, or waits for poses.
  if (is_excess() && !session_->nextWindow()) session_->giveUpOlderHalf();
}

void LiveMapping::keep(StoredKeyframe keyframe) {
  next_map_.trajectory.push_back({keyframe.t_ref_ns, keyframe.T_world_ref});
  next_map_.keyframes.push_back(std::move(keyframe));
}

void LiveMapping::forgetOldest() {
  std::vector<StoredKeyframe>& keyframes = next_map_.keyframes;
  if (keyframes.size() > static_cast<std::size_t>(options_.max_keyframes)) {
    keyframes.erase(keyframes.begin());
  }
}

void LiveMapping::publishState() {
  SessionStatus status = session_->status();
  if (std::exchange(told_choices_, status.choices) != status.choices) {
    callBack("the callback of the log", [&] { tellChoice(status, callbacks_); });
  }
  std::string failure;
  if (status.refinement && status.refinement->failures > warned_failures_) {
    warned_failures_ = status.refinement->failures;
    failure = status.refinement->last_error;
  }
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    status_ = std::move(status);
  }
  if (!failure.empty()) warn("refinement: " + failure);
}

/// Copies the keyframes and exports the cloud, unless this would take too large a part of the time.
void LiveMapping::publishMap(bool at_once) {
  const Clock::time_point begin = Clock::now();
  if (map_ && !map_changed_ && !at_once) return;
  if (map_ && !at_once && begin - map_renewed_ < kMapCostDivisor * map_cost_) return;
  std::shared_ptr<const MapSnapshot> made;
  try {
    session_->applyPending();
    const std::vector<Rigid3>& T_world_ref = session_->T_world_ref();
    std::vector<StampedPose>& trajectory = next_map_.trajectory;
    const std::size_t earlier = trajectory.size() - T_world_ref.size();
    const std::size_t forgotten = trajectory.size() - next_map_.keyframes.size();
    for (std::size_t i = earlier; i < trajectory.size(); ++i) {
      if (isSame(trajectory[i].T_world_rig, T_world_ref[i - earlier])) continue;
      if (i >= forgotten) next_map_.keyframes[i - forgotten].T_world_ref = T_world_ref[i - earlier];
      trajectory[i].T_world_rig = T_world_ref[i - earlier];
    }
    next_map_.T_odom_ref = session_->T_odom_ref();
    auto map = std::make_shared<MapSnapshot>(next_map_);
    map->points = session_->cloud().points();
    made = std::move(map);
  } catch (...) {
    noteError("the snapshot of the map", Fault::kMapping);
    map_renewed_ = Clock::now();  // the next try costs as much
    map_cost_ = map_renewed_ - begin;
    return;
  }
  map_renewed_ = Clock::now();
  map_cost_ = map_renewed_ - begin;
  map_changed_ = false;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    map_ = made;
  }
  if (!callbacks_.on_map || !thread_.joinable()) return;
  callBack("the callback of the map", [&] { callbacks_.on_map(made); });
}

/// What a host's callback throws is counted, and told the first time.
template <typename Call>
void LiveMapping::callBack(const char* name, Call call) {
  if (alone_) return;
  try {
    call();
  } catch (...) {
    noteError(name, Fault::kCallback);
  }
}

void LiveMapping::warn(const std::string& text) {
  if (callbacks_.warn) callBack("the callback of the log", [&] { callbacks_.warn(text); });
}

/// Within a handler. Throws nothing, even without memory: the thread has nobody to catch it.
void LiveMapping::noteError(const char* doing, Fault fault) noexcept {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (fault != Fault::kInput) ++live_.errors;
    if (fault == Fault::kMapping) live_.failing = true;
  }
  try {
    const std::string text = errorText();
    bool is_new = false;
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      is_new = live_.last_error != text;
      live_.last_error = text;
    }
    if (fault == Fault::kCallback) is_new = told_callbacks_.insert(doing).second;
    // Refusals at most once a second.
    const Clock::time_point now = Clock::now();
    const bool refused = fault == Fault::kInput;
    if (!is_new || (refused && now - refusal_logged_ < std::chrono::seconds(1))) return;
    if (refused) refusal_logged_ = now;
    warn(refused ? text : std::string(doing) + ": " + text);
  } catch (...) {  // no memory: it is counted
  }
}

/// At most once a second.
void LiveMapping::warnOfLosses() {
  const Clock::time_point now = Clock::now();
  if (now - warned_ < std::chrono::seconds(1)) return;
  std::uint64_t losses = 0;
  std::string text;
  const SessionStatus status = this->status();
  for (const auto& [camera, counts] : status.live->cameras) {
    losses += counts.dropped + counts.thinned + counts.refused + counts.lost;
    text += fmt::format(
        "; camera {}: {} dropped, {} thinned, {} refused, {} lost afterwards, of {} events", camera,
        counts.dropped, counts.thinned, counts.refused, counts.lost, counts.received);
  }
  const WindowsGivenUp& given_up = status.counts.windows_given_up;
  if (losses == warned_losses_ && given_up.total() == warned_given_up_) return;
  warned_ = now;
  warned_losses_ = losses;
  warned_given_up_ = given_up.total();
  warn(fmt::format("so far {}{}", asText(given_up), text));
}

void LiveMapping::finish() {
  if (runsHere()) throw std::logic_error("the builder cannot be finished from its own callback");
  queue_.end();
  std::unique_lock<std::mutex> lock(mutex_);
  finished_changed_.wait(lock, [this] { return finished_; });
  if (finish_error_) std::rethrow_exception(std::exchange(finish_error_, nullptr));
}

void LiveMapping::setSink(DsiSink* sink) {
  const std::lock_guard<std::mutex> lock(mutex_);
  sink_ = sink;
}

void LiveMapping::setClock(ProcessorClock clock) {
  const std::lock_guard<std::mutex> lock(mutex_);
  clock_ = std::move(clock);
}

SessionStatus LiveMapping::status() const {
  std::map<int, QueueCounts> cameras = queue_.counts();
  const std::uint64_t refused_poses = queue_.refusedPoses();
  const std::lock_guard<std::mutex> lock(mutex_);
  SessionStatus status = status_;
  const LiveStatus of_session = *status.live;
  for (const auto& [camera, counts] : of_session.cameras) cameras[camera].lost = counts.lost;
  status.live = live_;
  status.live->cameras = std::move(cameras);
  status.live->pose_jumps = of_session.pose_jumps;
  status.live->refused_poses += of_session.refused_poses + refused_poses;
  status.live->clock_steps = of_session.clock_steps;
  status.live->too_large = of_session.too_large;
  return status;
}

KeyframePoses LiveMapping::keyframePoses() {
  const auto map = snapshot();
  return efm::keyframePoses(map->trajectory, map->T_odom_ref);
}

std::shared_ptr<const MapSnapshot> LiveMapping::snapshot() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return map_;
}

std::pair<cv::Mat1f, DepthPlanesOptions> LiveMapping::newestDepth() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return {newest_depth_, planes_};
}

}  // namespace efm
