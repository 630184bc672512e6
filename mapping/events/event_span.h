// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <vector>

#include "mapping/events/event.h"

namespace efm {

/// Consecutive events that someone else owns, in time order.
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
