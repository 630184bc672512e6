// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/session/gate.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "mapping/geometry/rigid3.h"
#include "mapping/geometry/timestamp.h"

namespace efm {
namespace {

constexpr std::int64_t kIntervalNs = 10'000'000;
constexpr std::int64_t kLateIntervals = 100;
/// Number of the tracker among the cameras.
constexpr int kTracker = -1;
/// Poses that are far away are wrong if the tracker is back after this time at most.
constexpr std::int64_t kMaxAwayNs = 500'000'000;
/// Poses that are far away at the end are wrong if they are too few for a window.
constexpr std::int64_t kMinLastNs = 100'000'000;
/// As many inputs wait at most until it is clear what they are: the clock may stand still.
constexpr std::size_t kMaxHeld = 10'000;
/// Poses behind a jump wait this long for events.
constexpr std::int64_t kMaxJumpWaitNs = 600 * kNanosecondsPerSecond;

std::int64_t intervalOf(std::int64_t t_ns) {
  return t_ns / kIntervalNs - (t_ns % kIntervalNs < 0 ? 1 : 0);
}

std::uint64_t bytesOf(const EventPacket& packet) {
  return sizeof(EventPacket) + packet.events.all().capacity() * sizeof(Event);
}

}  // namespace

EventBudget::EventBudget(double max_rate)
    : max_per_interval_(static_cast<std::size_t>(std::ceil(max_rate / 100))) {}

std::vector<Event> EventBudget::pass(std::vector<Event> events,
                                     std::optional<std::int64_t>& complete_until_ns) {
  if (max_per_interval_ == 0) return events;
  std::vector<Event> passed;
  for (const Event& event : events) {
    const std::int64_t interval = intervalOf(event.t_ns);
    const bool is_late =
        !held_.empty() && interval < interval_ && interval > interval_ - kLateIntervals;
    if (interval != interval_ && !is_late) {
      endInterval(passed);
      interval_ = interval;
    }
    held_.push_back(event);
  }
  if (!complete_until_ns) return passed;
  if (intervalOf(*complete_until_ns) > interval_) endInterval(passed);
  if (!held_.empty()) {
    const auto earlier = [](const Event& a, const Event& b) { return a.t_ns < b.t_ns; };
    const Event& oldest = *std::min_element(held_.begin(), held_.end(), earlier);
    complete_until_ns = std::min({*complete_until_ns, interval_ * kIntervalNs, oldest.t_ns});
  }
  return passed;
}

std::vector<Event> EventBudget::finish() {
  std::vector<Event> passed;
  endInterval(passed);
  return passed;
}

void EventBudget::endInterval(std::vector<Event>& passed) {
  std::vector<Event> buffer;
  const EventSpan chosen = chooseEvenly(held_, max_per_interval_, buffer);
  subsampled_ += held_.size() - chosen.size();
  passed.insert(passed.end(), chosen.begin(), chosen.end());
  held_.clear();
}

Gate::Gate(const LiveOptions& options) : options_(options) {}

// --- Input ---

void Gate::add(const Rig& rig) {
  const std::lock_guard<std::mutex> lock(mutex_);
  rig_ = rig;
  push(Input(rig));
}

void Gate::add(EventPacket packet) {
  const std::lock_guard<std::mutex> lock(mutex_);
  receive(packet.camera, std::move(packet.events).take(), packet.complete_until_ns);
}

void Gate::add(int camera, std::vector<Event> events,
               std::optional<std::int64_t> complete_until_ns) {
  const std::lock_guard<std::mutex> lock(mutex_);
  try {
    requirePossible(events, camera, rig_.cameras.at(static_cast<std::size_t>(camera)));
  } catch (const std::invalid_argument&) {
    QueueCounts& counts = cameraOf(camera).counts;
    counts.received += events.size();
    counts.fates[ended_ ? QueueFate::kAfterEnd : QueueFate::kRejected] += events.size();
    throw;
  }
  receive(camera, std::move(events), complete_until_ns);
}

void Gate::skip(int camera, const std::vector<Event>& events) {
  const std::lock_guard<std::mutex> lock(mutex_);
  QueueCounts& counts = cameraOf(camera).counts;
  counts.received += events.size();
  counts.fates[QueueFate::kPaused] += events.size();
  if (ended_ || events.empty()) return;
  push(Input(Missing{camera, events.back().t_ns + 1, DropReason::kPaused}));
}

void Gate::add(PoseSample pose) {
  const std::lock_guard<std::mutex> lock(mutex_);
  if (ended_) {
    ++rejected_poses_;
    return;
  }
  if (!PoseIntake::isPossible(pose)) return push(Input(std::move(pose)));  // the session rejects it
  addTimely(pose_intake_.add(std::move(pose)));
  confirmEvents();
}

void Gate::end() {
  const std::lock_guard<std::mutex> lock(mutex_);
  if (ended_) return;
  if (!older_.empty() && older_.size() == cameras_.size() + (trackers_.empty() ? 0 : 1)) {
    resetClock();  // all sensors went back
  }
  for (auto& [index, camera] : cameras_) passRest(index, camera, true);
  addTimely(pose_intake_.finish());
  for (auto& [source, tracker] : trackers_) {
    auto& away = tracker.away;
    while (!away.empty() && away.back().back().t_ns - away.back().front().t_ns < kMinLastNs) {
      rejected_poses_ += away.back().size();
      away.pop_back();
    }
    jump(tracker);
  }
  while (!older_.empty()) rejectOlder(older_.begin()->first);
  ended_ = true;
  changed_.notify_one();
}

void Gate::stop() {
  const std::lock_guard<std::mutex> lock(mutex_);
  stopped_ = true;
  changed_.notify_one();
}

// --- Events ---

Gate::Camera& Gate::cameraOf(int index) {
  return cameras_.try_emplace(index, options_.max_event_rate).first->second;
}

std::int64_t Gate::offsetOf(int camera) const {
  const auto index = static_cast<std::size_t>(camera);
  return index < rig_.cameras.size() ? rig_.cameras[index].time_offset_ns : 0;
}

void Gate::receive(int index, std::vector<Event> events,
                   std::optional<std::int64_t> complete_until_ns) {
  Camera& camera = cameraOf(index);
  camera.counts.received += events.size();
  if (ended_) {
    camera.counts.fates[QueueFate::kAfterEnd] += events.size();
    return;
  }
  const auto first = std::find_if_not(
      events.begin(), events.end(), [&](const Event& event) { return camera.checker.pass(event); });
  std::vector<Event> rest(first, events.end());
  events.erase(first, events.end());
  std::vector<Event> right = std::move(events);
  std::optional<std::int64_t> first_late_ns;
  std::uint64_t late = 0;
  for (const Event& event : rest) {
    if (camera.checker.pass(event)) {
      right.push_back(event);
    } else if (camera.checker.add(event, 0) == EventChecker::Verdict::kLate) {
      if (late++ == 0) first_late_ns = event.t_ns;
    } else {
      ++camera.waiting;
      takeSettled(camera, right);
    }
  }
  const std::int64_t offset_ns = offsetOf(index);
  if (late > 0 && late == rest.size() && right.empty()) {
    return addOlder(index, trajectoryTime(*first_late_ns, offset_ns),
                    EventPacket{index, CheckedEvents(std::move(rest)), complete_until_ns});
  }
  late_events_ += late;
  camera.counts.fates[QueueFate::kRejected] += late;
  camera.complete_until_ns = complete_until_ns;
  if (!right.empty()) noteInTime(index, trajectoryTime(right.front().t_ns, offset_ns));
  pass(index, std::move(right));
  confirmEvents();
}

/// Passes what waits, at the end of the input or of the clock.
void Gate::passRest(int index, Camera& camera, bool at_end) {
  camera.checker.finish(at_end);
  std::vector<Event> rest;
  takeSettled(camera, rest);
  std::optional<std::int64_t> none;
  rest = camera.budget.pass(std::move(rest), none);
  const std::vector<Event> held = camera.budget.finish();
  rest.insert(rest.end(), held.begin(), held.end());
  if (!rest.empty()) push({index, CheckedEvents(std::move(rest)), camera.passed_until_ns});
}

/// Takes the events whose waiting has ended.
void Gate::takeSettled(Camera& camera, std::vector<Event>& right) {
  for (const EventChecker::Settled& settled : camera.checker.takeSettled()) {
    --camera.waiting;
    if (settled.wrong) {
      ++camera.counts.fates[QueueFate::kRejected];
    } else {
      right.push_back(settled.event);
    }
  }
}

/// Passes a packet of events that are right.
void Gate::pass(int index, std::vector<Event> right) {
  Camera& camera = cameraOf(index);
  if (!right.empty()) {
    camera.newest_ns = trajectoryTime(camera.checker.newestNs(), offsetOf(index));
    addTimely(pose_intake_.noteEvents(camera.newest_ns));
  }
  std::optional<std::int64_t> complete_until_ns = camera.complete_until_ns;
  if (complete_until_ns) {
    complete_until_ns = std::min(*complete_until_ns, camera.checker.waitsSinceNs());
  }
  right = camera.budget.pass(std::move(right), complete_until_ns);
  camera.passed_until_ns = complete_until_ns;
  push({index, CheckedEvents(std::move(right)), complete_until_ns});
}

/// Ends the waiting of events whose time other sensors have reached.
void Gate::confirmEvents() {
  for (auto& [index, camera] : cameras_) {
    if (camera.waiting == 0) continue;
    std::int64_t reached_ns = newest_pose_ns_;
    for (const auto& [other, of_other] : cameras_) {
      if (other != index) reached_ns = std::max(reached_ns, of_other.newest_ns);
    }
    if (trajectoryTime(camera.checker.lastRunSinceNs(), offsetOf(index)) > reached_ns) continue;
    camera.checker.confirmLast();
    std::vector<Event> right;
    takeSettled(camera, right);
    pass(index, std::move(right));
  }
}

void Gate::push(EventPacket packet) {
  events_ += packet.events.size();
  bytes_ += bytesOf(packet);
  packets_.emplace_back(next_number_++, std::move(packet));
  while (isFull() && !packets_.empty()) dropOldest();
  changed_.notify_one();
}

bool Gate::isFull() const {
  return events_ > static_cast<std::uint64_t>(options_.max_queue_events) ||
         static_cast<double>(bytes_) > options_.max_queue_mb * 1e6;
}

void Gate::dropOldest() {
  const EventPacket& oldest = packets_.front().second;
  events_ -= oldest.events.size();
  bytes_ -= bytesOf(oldest);
  cameraOf(oldest.camera).counts.fates[QueueFate::kQueueFull] += oldest.events.size();
  if (!oldest.events.empty()) {
    Missing& missing =
        missing_.try_emplace(oldest.camera, Missing{oldest.camera, kMinTimeNs}).first->second;
    missing.until_ns = std::max(missing.until_ns, oldest.events.back().t_ns + 1);
  }
  packets_.pop_front();
}

// --- Poses ---

void Gate::addTimely(std::vector<PoseSample> poses) {
  for (PoseSample& pose : poses) addTimely(std::move(pose));
}

/// Adds a pose whose time is right. Rejects poses that are far away from those before and behind
/// them.
void Gate::addTimely(PoseSample pose) {
  Tracker& tracker = trackers_[pose.source];
  const std::int64_t t_ns = pose.t_ns;
  if (tracker.newest && t_ns < tracker.newest->t_ns - kNanosecondsPerSecond) {
    return addOlder(kTracker, t_ns, std::move(pose));
  }
  noteInTime(kTracker, t_ns);
  newest_pose_ns_ = std::max(newest_pose_ns_, t_ns);
  if (tracker.newest && t_ns <= tracker.newest->t_ns) return push(Input(std::move(pose)));
  std::size_t joined = tracker.away.size();  // the last ones that the pose continues, from 1
  while (joined > 0 && isJump(tracker.away[joined - 1].back(), pose)) --joined;
  const bool is_back = joined == 0 && isBack(tracker, pose);
  if (is_back || joined > 0) {
    for (; tracker.away.size() > joined; tracker.away.pop_back()) {
      rejected_poses_ += tracker.away.back().size();
    }
  }
  if (is_back) {
    tracker.before = std::exchange(tracker.newest, pose);
    return push(Input(std::move(pose)));
  }
  if (joined == 0) tracker.away.emplace_back();
  tracker.away.back().push_back(std::move(pose));
  const auto wait_ns = std::min(kMaxAwayNs, durationFromSeconds(options_.max_pose_wait_s) / 2);
  if (t_ns - tracker.away.front().front().t_ns >= wait_ns ||
      tracker.away.back().size() == kMaxHeld) {
    jump(tracker);
  }
}

bool Gate::isJump(const PoseSample& from, const PoseSample& to) const {
  if (to.t_ns <= from.t_ns) return false;
  constexpr double kSigmas = 5;
  const PoseNoise noise = to.noise.value_or(PoseNoise{});
  const double dt_s = secondsBetween(from.t_ns, to.t_ns);
  const Rigid3 motion = from.T_world_rig().inverse() * to.T_world_rig();
  const double turn_rad = Eigen::AngleAxisd(motion.rotation).angle();
  return motion.translation.norm() > options_.max_speed_m_s * dt_s + kSigmas * noise.noise_m ||
         std::min(turn_rad, 2 * kPi - turn_rad) >
             options_.max_turn_deg_s * kRadiansPerDegree * dt_s + kSigmas * noise.noise_rad;
}

/// Returns whether a pose goes on where the tracker was before it was away.
bool Gate::isBack(const Tracker& tracker, const PoseSample& pose) const {
  if (!tracker.newest) return true;
  if (isJump(*tracker.newest, pose)) return false;
  if (tracker.away.empty()) return true;
  const Rigid3 T_world_newest = tracker.newest->T_world_rig();
  Rigid3 T_world_expected = T_world_newest;  // at constant velocity
  if (tracker.before && tracker.before->t_ns < tracker.newest->t_ns) {
    const double steps = secondsBetween(tracker.newest->t_ns, pose.t_ns) /
                         secondsBetween(tracker.before->t_ns, tracker.newest->t_ns);
    const Rigid3 T_before_newest = tracker.before->T_world_rig().inverse() * T_world_newest;
    T_world_expected = T_world_newest * rigidFromDifference(steps * differenceOf(T_before_newest));
  }
  const auto distance_to = [T = pose.T_world_rig()](const Rigid3& other) {
    return distanceBetween(other, T);
  };
  const double from_there = std::min(distance_to(T_world_newest), distance_to(T_world_expected));
  return from_there < distance_to(tracker.away.back().back().T_world_rig()) / 2;
}

/// Continues with the poses that are away: the tracker jumped.
void Gate::jump(Tracker& tracker) {
  for (std::vector<PoseSample>& run : std::exchange(tracker.away, {})) {
    push(Input(Jump{run.front().source, tracker.newest->t_ns, run.front().t_ns}));
    tracker.newest = run.back();
    tracker.before = run.size() > 1 ? std::optional(run[run.size() - 2]) : std::nullopt;
    for (PoseSample& pose : run) push(Input(std::move(pose)));
  }
}

// --- Clocks ---

/// Holds data that are older than earlier data of the sensor. If the sensor sends only older data
/// for a second of its clock, all clocks went back: the data are of the new clock. If it sends
/// newer data before, they are late. If other cameras go on ahead of a camera, only its own clock
/// is wrong.
void Gate::addOlder(int sensor, std::int64_t t_ns, Input input) {
  for (auto& [other, older] : older_) older.others_ns.erase(sensor);
  const Older& older = older_.try_emplace(sensor, Older{t_ns, {}}).first->second;
  const bool alone = sensor != kTracker &&
                     std::any_of(older.others_ns.begin(), older.others_ns.end(), [&](auto& other) {
                       return other.second - t_ns > kNanosecondsPerSecond;
                     });
  const bool went_back = !alone && t_ns - older.since_ns >= kNanosecondsPerSecond;
  if (const auto* packet = std::get_if<EventPacket>(&input)) {
    cameraOf(sensor).older += packet->events.size();
    held_events_ += packet->events.size();
  }
  held_.emplace_back(sensor, std::move(input));
  if (alone || held_.size() == kMaxHeld ||
      held_events_ > static_cast<std::uint64_t>(options_.max_queue_events)) {
    rejectHeld(sensor);
  }
  if (went_back) resetClock();
}

/// Begins a new clock with the held data.
void Gate::resetClock() {
  auto held = std::exchange(held_, {});
  endClock();
  for (auto& [of, one] : held) {
    if (auto* packet = std::get_if<EventPacket>(&one)) {
      Camera& camera = cameraOf(of);
      camera.older -= packet->events.size();
      held_events_ -= packet->events.size();
      camera.counts.received -= packet->events.size();  // received again
      receive(of, std::move(packet->events).take(), packet->complete_until_ns);
    } else {
      addTimely(pose_intake_.add(std::get<PoseSample>(std::move(one))));
    }
  }
}

/// Rejects the held data of a sensor: they are late.
void Gate::rejectHeld(int sensor) {
  for (auto& [of, one] : held_) {
    if (of != sensor) continue;
    if (const auto* packet = std::get_if<EventPacket>(&one)) {
      Camera& camera = cameraOf(of);
      const std::size_t events = packet->events.size();
      camera.older -= events;
      held_events_ -= events;
      late_events_ += events;
      camera.counts.fates[QueueFate::kRejected] += events;
    } else {
      push(std::move(one));  // the session rejects it
    }
  }
  held_.erase(std::remove_if(held_.begin(), held_.end(),
                             [&](const auto& one) { return one.first == sensor; }),
              held_.end());
}

void Gate::rejectOlder(int sensor) {
  if (older_.erase(sensor) > 0) rejectHeld(sensor);
}

/// Notes data that are not older than earlier data.
void Gate::noteInTime(int sensor, std::int64_t t_ns) {
  rejectOlder(sensor);
  if (sensor == kTracker) return;
  for (auto& [other, older] : older_) older.others_ns[sensor] = t_ns;
}

/// Passes or forgets what waits of the former clock.
void Gate::endClock() {
  for (auto& [index, camera] : cameras_) {
    passRest(index, camera, false);
    camera.checker = EventChecker();
    camera.newest_ns = kMinTimeNs;
    camera.complete_until_ns.reset();
    camera.passed_until_ns.reset();
  }
  pose_intake_.forget();
  for (const auto& [source, tracker] : trackers_) {
    for (const auto& run : tracker.away) rejected_poses_ += run.size();
  }
  trackers_.clear();
  older_.clear();
  newest_pose_ns_ = kMinTimeNs;
  push(Input(ClockReset{}));
}

// --- Output ---

void Gate::push(Input other) {
  others_.emplace_back(next_number_++, std::move(other));
  changed_.notify_one();
}

void Gate::wait(std::optional<Clock::time_point> until) {
  std::unique_lock<std::mutex> lock(mutex_);
  const auto has_input = [this] {
    return stopped_ || ended_ || !packets_.empty() || !missing_.empty() ||
           (!others_.empty() && !jumpWaits());
  };
  if (until) {
    changed_.wait_until(lock, *until, has_input);
  } else {
    changed_.wait(lock, has_input);
  }
}

/// Returns whether the next other input is a jump that waits for events.
bool Gate::jumpWaits() const {
  const auto* const jump = std::get_if<Jump>(&others_.front().second);
  return jump && complete_ns_ < jump->before_ns &&
         newest_pose_ns_ - jump->before_ns < kMaxJumpWaitNs && !(ended_ && packets_.empty());
}

std::optional<Input> Gate::take(std::int64_t complete_ns) {
  const std::lock_guard<std::mutex> lock(mutex_);
  complete_ns_ = complete_ns;
  if (!missing_.empty()) {
    const Missing missing = missing_.begin()->second;
    missing_.erase(missing_.begin());
    return missing;
  }
  if (others_.empty()) return takePacket();
  const auto precedes = [this](std::uint64_t number) {
    return packets_.empty() || number < packets_.front().first;
  };
  if (!jumpWaits()) return precedes(others_.front().first) ? takeOther() : takePacket();
  const auto reset = std::find_if(others_.begin(), others_.end(), [](const auto& numbered) {
    return std::holds_alternative<ClockReset>(numbered.second);
  });
  if (reset == others_.end() || !precedes(reset->first)) return takePacket();
  others_.erase(others_.begin(), reset);  // the poses behind the jump are of the former clock
  return takeOther();
}

std::optional<Input> Gate::takeOther() {
  Input taken = std::move(others_.front().second);
  others_.pop_front();
  return taken;
}

std::optional<Input> Gate::takePacket() {
  if (packets_.empty()) return std::nullopt;
  EventPacket taken = std::move(packets_.front().second);
  packets_.pop_front();
  events_ -= taken.events.size();
  bytes_ -= bytesOf(taken);
  cameraOf(taken.camera).counts.taken += taken.events.size();
  return taken;
}

bool Gate::isAtEnd() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return ended_ && packets_.empty() && others_.empty() && missing_.empty();
}

std::uint64_t Gate::queuedEvents() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return events_;
}

std::uint64_t Gate::lateEvents() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return late_events_;
}

std::uint64_t Gate::rejectedPoses() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return rejected_poses_ + pose_intake_.wrongPoses();
}

std::map<int, QueueCounts> Gate::counts() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  std::map<int, QueueCounts> counts;
  for (const auto& [index, camera] : cameras_) {
    QueueCounts& of_camera = counts[index];
    of_camera = camera.counts;
    of_camera.fates[QueueFate::kSubsampled] = camera.budget.subsampled();
    of_camera.held = camera.budget.held() + camera.waiting + camera.older;
    of_camera.queued =
        of_camera.received - of_camera.held - of_camera.taken - of_camera.fates.total();
  }
  return counts;
}

}  // namespace efm
