// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/session/input_queue.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <stdexcept>
#include <utility>

namespace efm {
namespace {

constexpr std::int64_t kIntervalNs = 10'000'000;
constexpr std::int64_t kLateIntervals = 100;

std::int64_t intervalOf(std::int64_t t_ns) {
  return t_ns / kIntervalNs - (t_ns % kIntervalNs < 0 ? 1 : 0);
}

std::uint64_t bytesOf(const QueuedPacket& packet) {
  return sizeof(QueuedPacket) + packet.events.all().capacity() * sizeof(Event);
}

/// Compares without overflow, because times are not checked yet.
bool isFarAfter(std::int64_t t_ns, std::int64_t other_ns, std::int64_t limit_ns = kFarAheadNs) {
  return t_ns > other_ns &&
         static_cast<std::uint64_t>(t_ns) - static_cast<std::uint64_t>(other_ns) >
             static_cast<std::uint64_t>(limit_ns);
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

void InputQueue::Stream::follow(std::int64_t t_ns) {
  if (!reached_ns || t_ns > *reached_ns || isFarAfter(*reached_ns, t_ns)) reached_ns = t_ns;
}

std::optional<Event> InputQueue::Stream::finalize(bool is_right, std::uint64_t& rejected) {
  std::optional<Event> waited = std::exchange(ahead, std::nullopt);
  if (!waited) return std::nullopt;
  if (!is_right) {
    ++rejected;
    return std::nullopt;
  }
  follow(waited->t_ns);
  return waited;
}

InputQueue::InputQueue(const LiveOptions& options) : options_(options) {}

InputQueue::Camera& InputQueue::cameraOf(int index) {
  return cameras_.try_emplace(index, options_.max_event_rate).first->second;
}

void InputQueue::add(const Rig& rig) {
  const std::lock_guard<std::mutex> lock(mutex_);
  new_rig_ = rig_ = rig;
  changed_.notify_one();
}

void InputQueue::add(EventPacket packet) {
  const std::lock_guard<std::mutex> lock(mutex_);
  take(packet.camera, std::move(packet.events).take(), packet.complete_until_ns);
}

void InputQueue::add(int camera, std::vector<Event> events,
                     std::optional<std::int64_t> complete_until_ns) {
  const std::lock_guard<std::mutex> lock(mutex_);
  try {
    requirePossible(events, camera, rig_.cameras.at(static_cast<std::size_t>(camera)));
  } catch (const std::invalid_argument&) {
    QueueCounts& counts = cameraOf(camera).counts;
    counts.received += events.size();
    counts.fates[ended_ ? EventFate::kAfterEnd : EventFate::kRejected] += events.size();
    throw;
  }
  take(camera, std::move(events), complete_until_ns);
}

void InputQueue::take(int index, std::vector<Event> events,
                      std::optional<std::int64_t> complete_until_ns) {
  Camera& camera = cameraOf(index);
  camera.counts.received += events.size();
  if (ended_) {
    camera.counts.fates[EventFate::kAfterEnd] += events.size();
    return;
  }
  takeAhead(index, events, complete_until_ns);
  if (camera.stream.reached_ns && std::size_t(index) < rig_.cameras.size()) {
    const std::int64_t offset_ns = rig_.cameras[static_cast<std::size_t>(index)].time_offset_ns;
    pushPoses(pose_intake_.noteEvents(trajectoryTime(*camera.stream.reached_ns, offset_ns)));
  }
  pass(index, std::move(events), complete_until_ns);
}

void InputQueue::pass(int index, std::vector<Event> events,
                      std::optional<std::int64_t> complete_until_ns) {
  Camera& camera = cameraOf(index);
  events = camera.budget.pass(std::move(events), complete_until_ns);
  camera.complete_until_ns = complete_until_ns;
  push({{index, CheckedEvents(std::move(events)), complete_until_ns}});
}

/// Rejects each event that is far ahead of the events before and after it. An event at the end of
/// the packet waits for the next packet. This packet decides about the waiting event.
void InputQueue::takeAhead(int index, std::vector<Event>& events,
                           std::optional<std::int64_t>& complete_until_ns) {
  Camera& camera = cameraOf(index);
  Stream& stream = camera.stream;
  const std::optional<std::int64_t> begin_ns =
      events.empty() ? complete_until_ns : std::optional(events.front().t_ns);
  const bool confirms = begin_ns && stream.ahead && !isFarAfter(stream.ahead->t_ns, *begin_ns);
  if (confirms || !events.empty()) {  // `complete_until_ns` alone rejects nothing
    if (auto waited = stream.finalize(confirms, camera.counts.fates[EventFate::kRejected])) {
      pass(index, {*waited}, std::nullopt);
    }
  }
  std::size_t kept = 0;
  for (std::size_t i = 0; i < events.size(); ++i) {
    const Event event = events[i];
    if (stream.reached_ns && isFarAfter(event.t_ns, *stream.reached_ns)) {
      if (i + 1 == events.size()) {
        stream.ahead = event;
        if (complete_until_ns) {  // the packet may end with this event
          complete_until_ns = std::min(*complete_until_ns, *stream.reached_ns);
        }
        continue;
      }
      if (isFarAfter(event.t_ns, events[i + 1].t_ns)) {
        ++camera.counts.fates[EventFate::kRejected];
        continue;
      }
    }
    stream.follow(event.t_ns);
    events[kept++] = event;
  }
  events.resize(kept);
  if (complete_until_ns) stream.follow(*complete_until_ns);
}

void InputQueue::push(QueuedPacket packet) {
  events_ += packet.events.size();
  bytes_ += bytesOf(packet);
  packets_.push_back(std::move(packet));
  while (isFull() && !packets_.empty()) dropOldest();
  changed_.notify_one();
}

bool InputQueue::isFull() const {
  return events_ > static_cast<std::uint64_t>(options_.max_queue_events) ||
         static_cast<double>(bytes_) > options_.max_queue_mb * 1e6;
}

void InputQueue::dropOldest() {
  const QueuedPacket& oldest = packets_.front();
  events_ -= oldest.events.size();
  bytes_ -= bytesOf(oldest);
  cameraOf(oldest.camera).counts.fates[EventFate::kQueueFull] += oldest.events.size();
  if (!oldest.events.empty() || oldest.skipped_until_ns) {
    const std::int64_t until_ns =
        oldest.skipped_until_ns ? *oldest.skipped_until_ns : oldest.events.back().t_ns + 1;
    MissingEvents& missing = missing_[oldest.camera];
    missing.until_ns = std::max(missing.until_ns, until_ns);
  }
  packets_.pop_front();
}

QueuedPacket skippedPacket(int camera, const std::vector<Event>& events) {
  QueuedPacket skipped{{camera, {}}};
  skipped.skipped_until_ns = events.back().t_ns + 1;
  return skipped;
}

void InputQueue::skip(int camera, const std::vector<Event>& events) {
  const std::lock_guard<std::mutex> lock(mutex_);
  QueueCounts& counts = cameraOf(camera).counts;
  counts.received += events.size();
  counts.fates[EventFate::kPaused] += events.size();
  if (!ended_ && !events.empty()) push(skippedPacket(camera, events));
}

void InputQueue::add(PoseSample pose) {
  const std::lock_guard<std::mutex> lock(mutex_);
  if (ended_) {
    ++rejected_poses_;
    return;
  }
  pushPoses(pose_intake_.add(std::move(pose)));
}

void InputQueue::pushPoses(std::vector<PoseSample> poses) {
  if (poses.empty()) return;
  std::move(poses.begin(), poses.end(), std::back_inserter(poses_));
  changed_.notify_one();
}

void InputQueue::end() {
  const std::lock_guard<std::mutex> lock(mutex_);
  if (ended_) return;
  ended_ = true;
  for (auto& [index, camera] : cameras_) {
    const std::optional<std::int64_t>& reached_ns = camera.stream.reached_ns;
    const bool is_right = reached_ns && camera.stream.ahead &&
                          !isFarAfter(camera.stream.ahead->t_ns, *reached_ns, kMaxLastPauseNs);
    if (auto last = camera.stream.finalize(is_right, camera.counts.fates[EventFate::kRejected])) {
      pass(index, {*last}, std::nullopt);
    }
    std::vector<Event> rest = camera.budget.finish();
    if (rest.empty()) continue;
    push({{index, CheckedEvents(std::move(rest)), camera.complete_until_ns}});
  }
  pushPoses(pose_intake_.finish());
  changed_.notify_one();
}

void InputQueue::stop() {
  const std::lock_guard<std::mutex> lock(mutex_);
  stopped_ = true;
  changed_.notify_one();
}

InputQueue::Batch InputQueue::wait(std::optional<Clock::time_point> until) {
  std::unique_lock<std::mutex> lock(mutex_);
  const auto has_input = [this] {
    return stopped_ || ended_ || new_rig_ || !packets_.empty() || !poses_.empty() ||
           !missing_.empty();
  };
  if (until) {
    changed_.wait_until(lock, *until, has_input);
  } else {
    changed_.wait(lock, has_input);
  }
  return takeLocked(true);
}

InputQueue::Batch InputQueue::take(bool all_mapped) {
  const std::lock_guard<std::mutex> lock(mutex_);
  return takeLocked(all_mapped);
}

InputQueue::Batch InputQueue::takeLocked(bool all_mapped) {
  Batch batch;
  batch.rig = std::exchange(new_rig_, std::nullopt);
  batch.poses = std::exchange(poses_, {});
  batch.missing = std::exchange(missing_, {});
  bool may_skip = all_mapped;  // until the first packet with events
  while (!packets_.empty() && (may_skip || !packets_.front().skipped_until_ns)) {
    QueuedPacket& next = packets_.front();
    may_skip = may_skip && next.skipped_until_ns;
    events_ -= next.events.size();
    bytes_ -= bytesOf(next);
    cameraOf(next.camera).counts.taken += next.events.size();
    batch.packets.push_back(std::move(next));
    packets_.pop_front();
  }
  batch.ended = ended_ && packets_.empty();
  return batch;
}

std::uint64_t InputQueue::queuedEvents() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return events_;
}

std::uint64_t InputQueue::rejectedPoses() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return rejected_poses_ + pose_intake_.wrongPoses();
}

std::map<int, QueueCounts> InputQueue::counts() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  std::map<int, QueueCounts> counts;
  for (const auto& [index, camera] : cameras_) {
    QueueCounts& of_camera = counts[index];
    of_camera = camera.counts;
    of_camera.fates[EventFate::kSubsampled] = camera.budget.subsampled();
    of_camera.held = camera.budget.held() + (camera.stream.ahead ? 1 : 0);
    of_camera.queued =
        of_camera.received - of_camera.held - of_camera.taken - of_camera.fates.total();
  }
  return counts;
}

}  // namespace efm
