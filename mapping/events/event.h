// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>

namespace efm {

/// An event may come after one of its camera that is newer by up to this: it is sorted and counted.
inline constexpr std::int64_t kMaxEventDelayNs = 10'000'000;

/// One brightness change seen by one pixel of an event camera (Ghosh and Gallego 2022, Eq. 1).
struct Event {
  std::int64_t t_ns = 0;  ///< Time in the recording's own clock, integer nanoseconds.
  std::uint16_t x =
      0;  ///< Raw (distorted) pixel column, 0 at the left; integers are pixel centres.
  std::uint16_t y = 0;    ///< Raw (distorted) pixel row, 0 at the top.
  bool polarity = false;  ///< True where it became brighter.

  friend bool operator==(const Event& a, const Event& b) {
    return a.t_ns == b.t_ns && a.x == b.x && a.y == b.y && a.polarity == b.polarity;
  }
};

}  // namespace efm
