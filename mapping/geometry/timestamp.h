// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <string_view>

namespace efm {

/// Time is in integer nanoseconds everywhere, because a double resolves today's Unix time only to
/// about 240 ns.

inline constexpr std::int64_t kNanosecondsPerSecond = 1'000'000'000;

inline constexpr std::int64_t kMaxTimeNs = std::numeric_limits<std::int64_t>::max();
inline constexpr std::int64_t kMinTimeNs = std::numeric_limits<std::int64_t>::min();

/// Times of recordings lie within [-kEndOfTimeNs, kEndOfTimeNs] (the year 2116). This is half the
/// range, so that sums and differences of times do not overflow.
inline constexpr std::int64_t kEndOfTimeNs = kMaxTimeNs / 2;

/// Parses decimal seconds ("12", "-0.5", "1.5e-3", "1700000000.123456789") to nanoseconds without
/// passing through a double. Digits past the ninth decimal are rounded to the nearest nanosecond.
/// @return std::nullopt if the whole text is not a number, or the number does not fit 64 bits.
std::optional<std::int64_t> parseSeconds(std::string_view text);

/// Parses a decimal number of units of 10^`exponent` seconds to nanoseconds, as above.
/// @param exponent -9 to 0; -6 for microseconds.
std::optional<std::int64_t> parseTimeIn(std::string_view text, int exponent);

/// Returns decimal seconds with nine decimals ("%.9f"), exactly.
std::string formatSeconds(std::int64_t t_ns);

/// Converts a duration in seconds to nanoseconds, rounded. Not for absolute times.
std::int64_t durationFromSeconds(double duration_s);

/// Returns to_ns - from_ns in seconds.
inline double secondsBetween(std::int64_t from_ns, std::int64_t to_ns) {
  return static_cast<double>(to_ns - from_ns) * 1e-9;
}

}  // namespace efm
