// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cmath>
#include <cstdint>
#include <optional>
#include <type_traits>

#include "mapping/geometry/timestamp.h"

namespace efm {

inline constexpr std::int64_t kNanosecondsPerMicrosecond = 1'000;

/// A number of a file as a whole number within [min, max]; nothing if it is none.
template <typename Number>
std::optional<std::int64_t> wholeNumber(Number number, std::int64_t min, std::int64_t max) {
  if constexpr (std::is_floating_point_v<Number>) {
    if (!(number >= static_cast<Number>(min) && number <= static_cast<Number>(max)) ||
        std::floor(number) != number) {
      return std::nullopt;
    }
  } else if constexpr (std::is_signed_v<Number>) {
    if (number < min || number > max) return std::nullopt;
  } else {
    if (max < 0 || number > static_cast<std::uint64_t>(max)) return std::nullopt;
  }
  return static_cast<std::int64_t>(number);
}

/// A time of a file in nanoseconds; nothing beyond `kEndOfTimeNs`. Real numbers are rounded to
/// whole microseconds: a double resolves today's times in seconds to 240 ns.
/// @param unit_ns of the number: whole microseconds.
template <typename Number>
std::optional<std::int64_t> nanoseconds(Number time, std::int64_t unit_ns) {
  if constexpr (std::is_floating_point_v<Number>) {
    const double microseconds = std::round(
        static_cast<double>(time) * static_cast<double>(unit_ns / kNanosecondsPerMicrosecond));
    constexpr std::int64_t kEnd = kEndOfTimeNs / kNanosecondsPerMicrosecond;
    const auto whole = wholeNumber(microseconds, -kEnd, kEnd);
    if (!whole) return std::nullopt;
    return *whole * kNanosecondsPerMicrosecond;
  } else {
    const std::int64_t end = kEndOfTimeNs / unit_ns;
    const auto whole = wholeNumber(time, -end, end);
    if (!whole) return std::nullopt;
    return *whole * unit_ns;
  }
}

}  // namespace efm
