// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/live/input_queue.h"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <stdexcept>
#include <utility>

#include "mapping/events/event_check.h"
#include "mapping/geometry/timestamp.h"

namespace efm {
namespace {

std::uint64_t bytesOf(const CameraPacket& packet) {
  return sizeof(CameraPacket) + packet.events.capacity() * sizeof(Event);
}

/// The last event, or pose, may come after a longer pause: nothing comes that confirms it.
constexpr std::uint64_t kMaxLastPauseNs = 10 * kNanosecondsPerSecond;

/// Without overflow: times are not checked yet.
bool isFarAfter(std::int64_t t_ns, std::int64_t other_ns,
                std::uint64_t limit_ns = kNanosecondsPerSecond) {
  return t_ns > other_ns &&
         static_cast<std::uint64_t>(t_ns) - static_cast<std::uint64_t>(other_ns) > limit_ns;
}

/// The newest time of a stream, whose clock may go back.
void follow(std::optional<std::int64_t>& reached_ns, std::int64_t t_ns) {
  if (!reached_ns || t_ns > *reached_ns || isFarAfter(*reached_ns, t_ns)) reached_ns = t_ns;
}

CameraPacket withoutEvents(const CameraPacket& packet) {
  return {packet.camera, packet.calibration, {}, packet.covered_until_ns};
}

}  // namespace

InputQueue::InputQueue(const LiveOptions& options) : options_(options) {}

InputQueue::Camera& InputQueue::cameraOf(int index) {
  return cameras_.try_emplace(index, options_.max_event_rate).first->second;
}

void InputQueue::add(CameraPacket packet) {
  const std::lock_guard<std::mutex> lock(mutex_);
  Camera& camera = cameraOf(packet.camera);
  camera.counts.received += packet.events.size();
  if (ended_) {
    camera.counts.after_end += packet.events.size();
    return;
  }
  try {
    requireInsideSensor(packet.events, packet.camera, packet.calibration.model);
    if (camera.last && !isSame(camera.last->calibration, packet.calibration)) {
      throw std::invalid_argument(
          fmt::format("camera {}: its calibration or its pose on the rig differs from that of its "
                      "earlier packets",
                      packet.camera));
    }
  } catch (const std::invalid_argument&) {
    camera.counts.refused += packet.events.size();
    throw;
  }
  takeAhead(camera, packet);
  pass(camera, std::move(packet));
}

void InputQueue::pass(Camera& camera, CameraPacket packet) {
  packet.events = camera.budget.pass(std::move(packet.events), packet.covered_until_ns);
  camera.last = withoutEvents(packet);
  push(std::move(packet));
}

/// Refuses each event that is far ahead of those before and after it. One at the end of the packet
/// waits; this packet decides about the one that waited.
void InputQueue::takeAhead(Camera& camera, CameraPacket& packet) {
  std::vector<Event>& events = packet.events;
  const std::optional<std::int64_t> begin_ns =
      events.empty() ? packet.covered_until_ns : std::optional(events.front().t_ns);
  if (camera.ahead && begin_ns) {
    const std::int64_t ahead_ns = camera.ahead->events.front().t_ns;
    if (!isFarAfter(ahead_ns, *begin_ns)) {
      follow(camera.reached_ns, ahead_ns);
      pass(camera, *std::exchange(camera.ahead, std::nullopt));
    } else if (!events.empty()) {
      ++camera.counts.refused;
      camera.ahead.reset();
    }
  }
  std::size_t kept = 0;
  for (std::size_t i = 0; i < events.size(); ++i) {
    const Event event = events[i];
    if (camera.reached_ns && isFarAfter(event.t_ns, *camera.reached_ns)) {
      if (i + 1 == events.size()) {
        camera.ahead = withoutEvents(packet);
        camera.ahead->covered_until_ns.reset();
        camera.ahead->events = {event};
        if (packet.covered_until_ns) {  // it may end with this event
          packet.covered_until_ns = std::min(*packet.covered_until_ns, *camera.reached_ns);
        }
        continue;
      }
      if (isFarAfter(event.t_ns, events[i + 1].t_ns)) {
        ++camera.counts.refused;
        continue;
      }
    }
    follow(camera.reached_ns, event.t_ns);
    events[kept++] = event;
  }
  events.resize(kept);
  if (packet.covered_until_ns) follow(camera.reached_ns, *packet.covered_until_ns);
}

void InputQueue::push(CameraPacket packet) {
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
  const CameraPacket& oldest = packets_.front();
  events_ -= oldest.events.size();
  bytes_ -= bytesOf(oldest);
  cameraOf(oldest.camera).counts.dropped += oldest.events.size();
  noteMissing(oldest, &WindowsGivenUp::overload);
  packets_.pop_front();
}

void InputQueue::noteMissing(const CameraPacket& packet, GiveUpReason reason) {
  if (packet.events.empty()) return;
  MissingEvents& missing = missing_[packet.camera];
  missing.until_ns = std::max(missing.until_ns, packet.events.back().t_ns + 1);
  missing.reason = reason;
}

void InputQueue::skip(const CameraPacket& packet) {
  const std::lock_guard<std::mutex> lock(mutex_);
  QueueCounts& counts = cameraOf(packet.camera).counts;
  counts.received += packet.events.size();
  counts.paused += packet.events.size();
  if (ended_) return;
  noteMissing(packet, &WindowsGivenUp::paused);
  changed_.notify_one();
}

void InputQueue::add(QueuedPose pose) {
  const std::lock_guard<std::mutex> lock(mutex_);
  if (ended_) {
    ++refused_poses_;
    return;
  }
  PoseStream& stream = pose_streams_[pose.source];
  if (const auto waiting = std::exchange(stream.ahead, std::nullopt)) {
    const std::int64_t ahead_ns = waiting->pose.t_ns;
    if (isFarAfter(ahead_ns, pose.pose.t_ns)) {
      ++refused_poses_;
    } else {
      follow(stream.reached_ns, ahead_ns);
      poses_.push_back(*waiting);
    }
  }
  if (stream.reached_ns && isFarAfter(pose.pose.t_ns, *stream.reached_ns)) {
    stream.ahead = std::move(pose);
  } else {
    follow(stream.reached_ns, pose.pose.t_ns);
    poses_.push_back(std::move(pose));
  }
  changed_.notify_one();
}

void InputQueue::end() {
  const std::lock_guard<std::mutex> lock(mutex_);
  if (ended_) return;
  ended_ = true;
  for (auto& [index, camera] : cameras_) {
    if (auto last = std::exchange(camera.ahead, std::nullopt)) {
      const std::int64_t last_ns = last->events.front().t_ns;
      if (isFarAfter(last_ns, *camera.reached_ns, kMaxLastPauseNs)) {
        ++camera.counts.refused;
      } else {
        pass(camera, std::move(*last));
      }
    }
    if (!camera.last) continue;
    CameraPacket rest = *camera.last;
    rest.events = camera.budget.finish();
    if (!rest.events.empty()) push(std::move(rest));
  }
  for (auto& [source, stream] : pose_streams_) {
    const auto last = std::exchange(stream.ahead, std::nullopt);
    if (!last) continue;
    if (isFarAfter(last->pose.t_ns, *stream.reached_ns, kMaxLastPauseNs)) {
      ++refused_poses_;
    } else {
      poses_.push_back(*last);
    }
  }
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
    return stopped_ || ended_ || !packets_.empty() || !poses_.empty() || !missing_.empty();
  };
  if (until) {
    changed_.wait_until(lock, *until, has_input);
  } else {
    changed_.wait(lock, has_input);
  }
  return takeLocked();
}

InputQueue::Batch InputQueue::take() {
  const std::lock_guard<std::mutex> lock(mutex_);
  return takeLocked();
}

InputQueue::Batch InputQueue::takeLocked() {
  Batch batch;
  batch.poses = std::exchange(poses_, {});
  batch.packets.assign(std::move_iterator(packets_.begin()), std::move_iterator(packets_.end()));
  packets_.clear();
  for (const CameraPacket& packet : batch.packets) {
    cameraOf(packet.camera).counts.taken += packet.events.size();
  }
  batch.missing = std::exchange(missing_, {});
  events_ = 0;
  bytes_ = 0;
  batch.ended = ended_;
  batch.stopped = stopped_;
  return batch;
}

std::uint64_t InputQueue::queuedEvents() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return events_;
}

std::uint64_t InputQueue::refusedPoses() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return refused_poses_;
}

std::map<int, QueueCounts> InputQueue::counts() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  std::map<int, QueueCounts> counts;
  for (const auto& [index, camera] : cameras_) {
    QueueCounts& of_camera = counts[index];
    of_camera = camera.counts;
    of_camera.thinned = camera.budget.thinned();
    of_camera.held = camera.budget.held() + (camera.ahead ? 1 : 0);
    of_camera.queued = of_camera.received - of_camera.thinned - of_camera.held - of_camera.dropped -
                       of_camera.paused - of_camera.refused - of_camera.after_end - of_camera.taken;
  }
  return counts;
}

}  // namespace efm
