// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <mrpt/core/Clock.h>

#include <cstdint>
#include <limits>
#include <optional>
#include <stdexcept>

namespace efm {

/// MRPT's clock counts ticks of 100 ns since 1601. The recording's clock counts as Unix time.
inline constexpr std::int64_t kMrptTickNs = 100;
inline constexpr std::int64_t kMrptTicksAtUnixEpoch = 116'444'736'000'000'000;

/// The nearest tick, at most 50 ns away.
inline mrpt::Clock::time_point mrptTimeFrom(std::int64_t t_ns) {
  std::int64_t ticks = t_ns / kMrptTickNs;
  const std::int64_t rest_ns = t_ns % kMrptTickNs;
  if (2 * rest_ns >= kMrptTickNs) ++ticks;
  if (2 * rest_ns < -kMrptTickNs) --ticks;
  return mrpt::Clock::time_point(mrpt::Clock::duration(ticks + kMrptTicksAtUnixEpoch));
}

/// Exact. @return nothing for INVALID_TIMESTAMP (0 ticks) and outside the range of nanoseconds:
/// before 1677 or after 2262.
inline std::optional<std::int64_t> nanosecondsIfKnown(const mrpt::Clock::time_point& time) {
  constexpr std::int64_t kMaxTicks = std::numeric_limits<std::int64_t>::max() / kMrptTickNs;
  const std::int64_t ticks = time.time_since_epoch().count();
  if (ticks < kMrptTicksAtUnixEpoch - kMaxTicks || ticks > kMrptTicksAtUnixEpoch + kMaxTicks) {
    return std::nullopt;
  }
  return (ticks - kMrptTicksAtUnixEpoch) * kMrptTickNs;
}

/// Exact. @throws std::invalid_argument if `nanosecondsIfKnown` returns nothing.
inline std::int64_t nanosecondsFrom(const mrpt::Clock::time_point& time) {
  const std::optional<std::int64_t> t_ns = nanosecondsIfKnown(time);
  if (!t_ns) throw std::invalid_argument("a time stamp is missing or not between 1678 and 2261");
  return *t_ns;
}

}  // namespace efm
