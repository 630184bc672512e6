// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/keyframes/camera_stream.h"

#include <algorithm>
#include <stdexcept>
#include <string>

namespace efm {
namespace {

[[noreturn]] void refuse(const Event& event, int camera, const std::string& expected) {
  throw std::invalid_argument("camera " + std::to_string(camera) + ", event at " +
                              formatSeconds(event.t_ns) + " s: " + expected);
}

}  // namespace

EventCounts& EventCounts::operator+=(const EventCounts& other) {
  read += other.read;
  used += other.used;
  without_pose += other.without_pose;
  outside_window += other.outside_window;
  filtered += other.filtered;
  dropped += other.dropped;
  return *this;
}

CameraStream::CameraStream(int index, const RigCamera& camera, bool selected,
                           const EventFilterOptions& filter)
    : index_(index),
      width_(camera.model.width),
      height_(camera.model.height),
      time_offset_ns_(camera.time_offset_ns),
      selected_(selected) {
  if (filter.any()) filter_.emplace(EventFilter(width_, height_, filter));
}

void CameraStream::requireValid(const std::vector<Event>& events) const {
  std::int64_t newest_ns = newest_ns_.value_or(kMinTimeNs + kMaxEventDelayNs);
  for (const Event& event : events) {
    if (event.x >= width_ || event.y >= height_) {
      refuse(event, index_,
             "pixel (" + std::to_string(event.x) + ", " + std::to_string(event.y) +
                 ") must lie inside the sensor of " + std::to_string(width_) + "x" +
                 std::to_string(height_));
    }
    if (event.t_ns < -kEndOfTimeNs || event.t_ns > kEndOfTimeNs) {
      refuse(event, index_, "times must lie within " + formatSeconds(kEndOfTimeNs) + " s");
    }
    const std::int64_t t_ns = onTrajectoryClock(event.t_ns);
    if (t_ns < newest_ns - kMaxEventDelayNs) {
      refuse(event, index_,
             "must not come more than 10 ms after a newer one, that at " +
                 formatSeconds(newest_ns - time_offset_ns_) + " s");
    }
    newest_ns = std::max(newest_ns, t_ns);
  }
}

std::uint64_t CameraStream::add(std::vector<Event> events, const TimeLimits& limits,
                                std::int64_t released_ns) {
  counts_.read += events.size();
  for (Event& event : events) {
    event.t_ns += time_offset_ns_;
    newest_ns_ = std::max(newest_ns_.value_or(event.t_ns), event.t_ns);
  }
  const auto isUnwanted = [&](const Event& event) {
    if (selected_ && limits.contain(event.t_ns) && event.t_ns >= released_ns) return false;
    const bool outside_window = selected_ && !limits.contain(event.t_ns);
    ++(outside_window ? counts_.outside_window : counts_.dropped);
    return true;
  };
  events.erase(std::remove_if(events.begin(), events.end(), isUnwanted), events.end());
  covered_ns_ = std::max(covered_ns_, *newest_ns_ - kMaxEventDelayNs);
  return filter_ ? filter_->insert(events) : buffer_.insert(events);
}

void CameraStream::coverUntil(std::int64_t t_ns) {
  covered_ns_ =
      std::max(covered_ns_, onTrajectoryClock(std::clamp(t_ns, -kEndOfTimeNs, kEndOfTimeNs)));
}

void CameraStream::filterUntil(std::int64_t t_ns) {
  if (filter_) counts_.filtered += filter_->release(t_ns, buffer_);
}

std::optional<std::int64_t> CameraStream::firstFrom(std::int64_t t_ns) const {
  const std::size_t first = buffer_.indexOf(t_ns);
  if (first == buffer_.events.size()) return std::nullopt;
  return buffer_.events[first].t_ns;
}

std::optional<std::int64_t> CameraStream::firstWithPose(const Trajectory& trajectory,
                                                        std::int64_t until_ns) {
  for (const Event& event : buffer_.between(kMinTimeNs, until_ns)) {
    if (trajectory.segmentAt(event.t_ns, pose_cursor_)) return event.t_ns;
  }
  return std::nullopt;
}

void CameraStream::markUsed(const Window& window, const Trajectory& trajectory) {
  const std::size_t end = buffer_.indexOf(window.t1_ns);
  for (std::size_t i = buffer_.indexOf(window.t0_ns); i < end; ++i) {
    if (trajectory.segmentAt(buffer_.events[i].t_ns, pose_cursor_)) buffer_.used[i] = true;
  }
}

void CameraStream::release(std::int64_t until_ns, const Trajectory& trajectory) {
  const std::size_t end = buffer_.indexOf(until_ns);
  for (; buffer_.begin < end; ++buffer_.begin) {
    if (buffer_.used[buffer_.begin]) {
      ++counts_.used;
    } else if (trajectory.segmentAt(buffer_.events[buffer_.begin].t_ns, pose_cursor_)) {
      ++counts_.outside_window;
    } else {
      ++counts_.without_pose;
    }
  }
  buffer_.compact();
}

}  // namespace efm
