// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace efm {

/// An event may arrive after a newer one of its camera, late by at most this: it is sorted and
/// counted.
inline constexpr std::int64_t kMaxEventDelayNs = 10'000'000;

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

}  // namespace efm
