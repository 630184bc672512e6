// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "mapping/geometry/rig.h"

namespace efm {

/// One brightness change at one pixel of an event camera (Ghosh and Gallego 2022, Eq. 1). Pixels
/// are raw (distorted). Integer coordinates are pixel centres.
struct Event {
  std::int64_t t_ns = 0;  ///< Time on the recording's own clock.
  std::uint16_t x = 0;    ///< Column, 0 at the left.
  std::uint16_t y = 0;    ///< Row, 0 at the top.
  bool polarity = false;  ///< True if the pixel became brighter.

  friend bool operator==(const Event& a, const Event& b) {
    return a.t_ns == b.t_ns && a.x == b.x && a.y == b.y && a.polarity == b.polarity;
  }
};

/// A view of consecutive events in time order; owns nothing.
class EventSpan {
 public:
  EventSpan() = default;
  EventSpan(const Event* begin, const Event* end) : begin_(begin), end_(end) {}
  EventSpan(const std::vector<Event>& events)  // NOLINT(google-explicit-constructor)
      : begin_(events.data()), end_(events.data() + events.size()) {}

  const Event* begin() const { return begin_; }
  const Event* end() const { return end_; }
  std::size_t size() const { return static_cast<std::size_t>(end_ - begin_); }
  bool empty() const { return begin_ == end_; }
  const Event& operator[](std::size_t i) const { return begin_[i]; }
  /// Returns the index of the first event at or after a time.
  std::size_t indexOf(std::int64_t t_ns) const;
  /// Returns the events of [t0, t1).
  EventSpan between(std::int64_t t0_ns, std::int64_t t1_ns) const {
    return part(indexOf(t0_ns), indexOf(t1_ns));
  }
  /// Returns the events [first, last) of this span.
  EventSpan part(std::size_t first, std::size_t last) const {
    return {begin_ + first, begin_ + last};
  }

 private:
  const Event* begin_ = nullptr;
  const Event* end_ = nullptr;
};

/// Events of one camera that were checked: they lie inside the sensor, and none is over 10 ms older
/// than an event before it. Reads like a const vector.
class CheckedEvents {
 public:
  CheckedEvents() = default;
  /// For code that has checked the events.
  explicit CheckedEvents(std::vector<Event> events) : events_(std::move(events)) {}

  auto begin() const { return events_.begin(); }
  auto end() const { return events_.end(); }
  std::size_t size() const { return events_.size(); }
  bool empty() const { return events_.empty(); }
  const Event& front() const { return events_.front(); }
  const Event& back() const { return events_.back(); }
  const std::vector<Event>& all() const { return events_; }
  /// Returns the events, which need another check if they are changed.
  std::vector<Event> take() && { return std::move(events_); }

 private:
  std::vector<Event> events_;
};

/// Largest delay of an event that arrives after a newer event of its camera. Such an event is
/// sorted into place and counted.
inline constexpr std::int64_t kMaxEventDelayNs = 10'000'000;

/// Poses that are farther than kFarAheadNs ahead of their stream wait: see `EventChecker`, as for
/// kMaxLastPauseNs.
inline constexpr std::int64_t kFarAheadNs = 1'000'000'000;
inline constexpr std::int64_t kMaxLastPauseNs = 10'000'000'000;

/// Rejects an event. @throws std::invalid_argument "camera 0, event at 1.000000000 s: expected".
[[noreturn]] void reject(const Event& event, int camera, const std::string& expected);

[[noreturn]] void rejectLate(const Event& event, int camera, std::int64_t newest_ns);

/// @throws std::invalid_argument naming the first event that lies outside the sensor, or whose time
/// is not within kEndOfTimeNs, also with the camera's offset.
void requirePossible(EventSpan events, int camera, const RigCamera& calibration);

/// A choice of a limited number of events, evenly spread over consecutive events. The events are
/// divided into intervals of equal count (to within one event), and one event of each interval is
/// chosen. Its position in the interval is pseudo-random, because a regular step could favour a
/// sensor's rows or one polarity. The choice depends only on `events` and `limit`.
class EvenChoice {
 public:
  /// @param limit maximum number of chosen events; 0: all.
  EvenChoice(std::size_t events, std::size_t limit);

  /// Returns whether every event is chosen.
  bool all() const { return size_ == events_; }
  std::size_t size() const { return size_; }
  /// Returns the index of the k-th chosen event. It increases with k.
  std::size_t operator[](std::size_t k) const;

 private:
  std::size_t events_;
  std::size_t size_;
};

/// Returns the chosen events in their order: a view of `events` if all are chosen, otherwise a view
/// of `buffer`.
/// @param buffer receives the chosen events; the view is valid until `buffer` changes.
EventSpan chooseEvenly(EventSpan events, std::size_t limit, std::vector<Event>& buffer);
/// Returns a copy of the chosen events.
std::vector<Event> chosenEvenly(EventSpan events, std::size_t limit);

/// One camera's events that a window may still need, in time order.
struct EventBuffer {
  std::vector<Event> events;
  std::vector<bool> used;  ///< Parallel to `events`: true if the event voted in a keyframe.
  std::size_t begin = 0;   ///< Events before this index are released.

  /// Returns the index of the first event at or after a time.
  std::size_t indexOf(std::int64_t t_ns) const;
  /// Returns the events of [t0, t1). The view is valid until the buffer changes.
  EventSpan between(std::int64_t t0_ns, std::int64_t t1_ns) const {
    return EventSpan(events).part(indexOf(t0_ns), indexOf(t1_ns));
  }
  /// Inserts events, each after the events of the same time. Cost: linear if events come in time
  /// order; otherwise the cost of sorting the events after the earliest late event.
  /// @return the number of events that came after a newer event.
  /// @throws std::bad_alloc; the buffer is then unchanged.
  std::uint64_t insert(EventSpan added);
  /// Removes the events from an index on.
  void cut(std::size_t index) {
    events.resize(index);
    used.resize(index);
  }
  /// Frees the memory of released events; cost is constant on average.
  void compact();

 private:
  void sortFrom(std::size_t index);
};

}  // namespace efm
