// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/keyframes/camera_stream.h"

#include <algorithm>
#include <new>
#include <utility>

namespace efm {
namespace {

/// Returns the time before which events are too late after an event at `t_ns` (any number).
std::int64_t lateAfter(std::int64_t t_ns) {
  return std::max(t_ns, kMinTimeNs + kMaxEventDelayNs) - kMaxEventDelayNs;
}

bool isInOneOf(const std::vector<Window>& windows, std::int64_t t_ns) {
  return std::any_of(windows.begin(), windows.end(),
                     [&](const Window& window) { return window.contains(t_ns); });
}

/// Finds out for increasing times whether a trajectory has a pose. Searches it once per segment.
class PosedTimes {
 public:
  PosedTimes(const Trajectory& trajectory, std::size_t& cursor)
      : trajectory_(trajectory), cursor_(cursor) {}

  bool contain(std::int64_t t_ns) {
    if (t_ns >= first_ns_ && t_ns <= last_ns_) return true;
    const auto segment = trajectory_.segmentAt(t_ns, cursor_);
    if (!segment) return false;
    first_ns_ = segment->first.t_ns;
    last_ns_ = segment->last.t_ns;
    return true;
  }

 private:
  const Trajectory& trajectory_;
  std::size_t& cursor_;
  std::int64_t first_ns_ = kMaxTimeNs;
  std::int64_t last_ns_ = kMinTimeNs;
};

}  // namespace

CameraStream::CameraStream(int index, const RigCamera& camera, bool selected,
                           std::vector<bool> outside_lens, const EventFilterOptions& filter)
    : index_(index), camera_(camera), selected_(selected), outside_lens_(std::move(outside_lens)) {
  if (filter.any()) filter_.emplace(EventFilter(camera_.model.width, camera_.model.height, filter));
}

void CameraStream::requireNext(const CheckedEvents& packet) const {
  for (const Event& event : {packet.front(), packet.back()}) {
    requirePossible({&event, &event + 1}, index_, camera_);
    if (event.t_ns < lateBefore()) rejectLate(event, index_, *newest_ns_ - camera_.time_offset_ns);
  }
}

/// Returns the time, on the camera's clock, before which events are too late.
std::int64_t CameraStream::lateBefore() const {
  return newest_ns_ ? lateAfter(*newest_ns_ - camera_.time_offset_ns) : kMinTimeNs;
}

std::uint64_t CameraStream::add(std::vector<Event> events, const TimeLimits& limits,
                                std::int64_t released_ns) {
  counts_.read += events.size();
  for (Event& event : events) {
    event.t_ns += camera_.time_offset_ns;
    newest_ns_ = std::max(newest_ns_.value_or(event.t_ns), event.t_ns);
  }
  const auto isUnwanted = [&](const Event& event) {
    const auto width = static_cast<std::size_t>(camera_.model.width);
    std::optional<EventFate> fate;
    if (selected_ && !limits.contain(event.t_ns)) {
      fate = EventFate::kOutsideWindow;
    } else if (!selected_) {
      fate = EventFate::kUnselected;
    } else if (event.t_ns < released_ns) {
      fate = event.t_ns < dropped_until_ns_ ? EventFate::kDropped : EventFate::kLate;
    } else if (!outside_lens_.empty() && outside_lens_[event.y * width + event.x]) {
      fate = EventFate::kOutsideLens;
    }
    if (fate) ++counts_[*fate];
    return fate.has_value();
  };
  events.erase(std::remove_if(events.begin(), events.end(), isUnwanted), events.end());
  complete_ns_ = std::max(complete_ns_, *newest_ns_ - kMaxEventDelayNs);
  try {
    return filter_ ? filter_->insert(events) : buffer_.insert(events);
  } catch (const std::bad_alloc&) {
    counts_[EventFate::kDropped] += events.size();
    throw;
  }
}

void CameraStream::setCompleteUntil(std::int64_t t_ns) {
  const std::int64_t own_ns = std::clamp(t_ns, -kEndOfTimeNs, kEndOfTimeNs);
  complete_ns_ =
      std::max(complete_ns_, std::clamp(onTrajectoryClock(own_ns), -kEndOfTimeNs, kEndOfTimeNs));
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

std::optional<std::int64_t> CameraStream::lastWithPose(const Trajectory& trajectory,
                                                       std::int64_t until_ns) {
  const EventSpan before = buffer_.between(kMinTimeNs, until_ns);
  for (std::size_t i = before.size(); i-- > 0;) {
    if (trajectory.segmentAt(before[i].t_ns, pose_cursor_)) return before[i].t_ns;
  }
  return std::nullopt;
}

void CameraStream::markUsed(const Window& window, const Trajectory& trajectory,
                            std::size_t max_events) {
  PosedTimes posed(trajectory, pose_cursor_);
  const std::size_t begin = buffer_.indexOf(window.t0_ns);
  const EvenChoice choice(buffer_.indexOf(window.t1_ns) - begin, max_events);
  if (!choice.all()) over_budget_.push_back(window);
  for (std::size_t k = 0; k < choice.size(); ++k) {
    const std::size_t i = begin + choice[k];
    if (posed.contain(buffer_.events[i].t_ns)) buffer_.used[i] = true;
  }
}

void CameraStream::dropWindows(std::int64_t t0_ns, std::int64_t t1_ns) {
  if (t0_ns >= t1_ns) return;
  dropped_until_ns_ = std::max(dropped_until_ns_, t1_ns);
  if (!dropped_.empty() && dropped_.back().t1_ns >= t0_ns) {
    dropped_.back().t1_ns = std::max(dropped_.back().t1_ns, t1_ns);
  } else {
    dropped_.push_back({t0_ns, t1_ns, t0_ns});
  }
}

void CameraStream::release(std::int64_t until_ns, const Trajectory& trajectory) {
  PosedTimes posed(trajectory, pose_cursor_);
  const std::size_t end = buffer_.indexOf(until_ns);
  for (; buffer_.begin < end; ++buffer_.begin) {
    const std::int64_t t_ns = buffer_.events[buffer_.begin].t_ns;
    ++counts_[buffer_.used[buffer_.begin]     ? EventFate::kUsed
              : !posed.contain(t_ns)          ? EventFate::kWithoutPose
              : isInOneOf(over_budget_, t_ns) ? EventFate::kOverBudget
              : isInOneOf(dropped_, t_ns)     ? EventFate::kDropped
                                              : EventFate::kOutsideWindow];
  }
  for (std::vector<Window>* windows : {&over_budget_, &dropped_}) {
    windows->erase(std::remove_if(windows->begin(), windows->end(),
                                  [&](const Window& window) { return window.t1_ns <= until_ns; }),
                   windows->end());
  }
  buffer_.compact();
}

}  // namespace efm
