// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "mapping/geometry/rig.h"

namespace efm {

/// One brightness change at one pixel of an event camera (Ghosh and Gallego 2022, Eq. 1). Pixels
/// are raw (distorted), their integer coordinates are pixel centres.
struct Event {
  std::int64_t t_ns = 0;  ///< On the recording's own clock.
  std::uint16_t x = 0;    ///< Column, 0 at the left.
  std::uint16_t y = 0;    ///< Row, 0 at the top.
  bool polarity = false;  ///< True: the pixel became brighter.

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
  /// Events [first, last) of this span.
  EventSpan part(std::size_t first, std::size_t last) const {
    return {begin_ + first, begin_ + last};
  }

 private:
  const Event* begin_ = nullptr;
  const Event* end_ = nullptr;
};

/// An event may arrive after a newer one of its camera, late by at most this: it is sorted and
/// counted.
inline constexpr std::int64_t kMaxEventDelayNs = 10'000'000;

/// An event, or a pose, that is farther ahead of its stream than this is wrong where the next one
/// is back. The last one, which nothing follows, is wrong after a longer pause alone.
inline constexpr std::int64_t kFarAheadNs = 1'000'000'000;
inline constexpr std::int64_t kMaxLastPauseNs = 10'000'000'000;

/// @throws std::invalid_argument "camera 0, event at 1.000000000 s: expected".
[[noreturn]] void reject(const Event& event, int camera, const std::string& expected);

/// @throws std::invalid_argument naming the first event that lies outside the sensor.
void requireInsideSensor(EventSpan events, int camera, const CameraModel& model);

/// A limited number of consecutive events, evenly spread over them. The events are divided into
/// intervals of the same count, up to one event, and one event of each is chosen. Its position in
/// the interval is pseudo-random: a regular step could favour a sensor's rows or one polarity.
/// Depends on both numbers alone.
class EvenChoice {
 public:
  /// @param limit maximum number of chosen events; 0: all.
  EvenChoice(std::size_t events, std::size_t limit);

  /// Whether every event is chosen.
  bool all() const { return size_ == events_; }
  std::size_t size() const { return size_; }
  /// Index of the k-th chosen event, increasing with k.
  std::size_t operator[](std::size_t k) const;

 private:
  std::size_t events_;
  std::size_t size_;
};

/// The chosen events in their order: a view of `events` where all are chosen, otherwise of
/// `buffer`.
/// @param buffer receives the chosen events; the view is valid until it changes.
EventSpan chooseEvenly(EventSpan events, std::size_t limit, std::vector<Event>& buffer);
/// A copy of the chosen events.
std::vector<Event> chosenEvenly(EventSpan events, std::size_t limit);

/// One camera's events that a window may still need, in time order.
struct EventBuffer {
  std::vector<Event> events;
  std::vector<bool> used;  ///< Parallel to `events`: the event voted in a keyframe.
  std::size_t begin = 0;   ///< Events before this index are released.

  /// Index of the first event at or after a time.
  std::size_t indexOf(std::int64_t t_ns) const;
  /// The events of [t0, t1). Valid until the buffer changes.
  EventSpan between(std::int64_t t0_ns, std::int64_t t1_ns) const {
    return EventSpan(events).part(indexOf(t0_ns), indexOf(t1_ns));
  }
  /// Inserts events, each after others of the same time. Cost: linear for events in time order;
  /// otherwise that of sorting the events after the earliest late one.
  /// @return the number of events that came after a newer one.
  /// @throws std::bad_alloc without a change.
  std::uint64_t insert(EventSpan added);
  /// Forgets the events from an index on.
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
