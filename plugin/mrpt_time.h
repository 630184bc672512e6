// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <mrpt/core/Clock.h>

#include <cstdint>

namespace efm {

/// MRPT's clock counts ticks of 100 ns since 1601; the recording's clock is taken for Unix time.
inline constexpr std::int64_t kMrptTickNs = 100;
inline constexpr std::int64_t kMrptTicksAtUnixEpoch = 116'444'736'000'000'000;

/// The tick nearest to a time: at most 50 ns away.
inline mrpt::Clock::time_point mrptTimeFrom(std::int64_t t_ns) {
  std::int64_t ticks = t_ns / kMrptTickNs;
  const std::int64_t rest_ns = t_ns % kMrptTickNs;
  if (2 * rest_ns >= kMrptTickNs) ++ticks;
  if (2 * rest_ns < -kMrptTickNs) --ticks;
  return mrpt::Clock::time_point(mrpt::Clock::duration(ticks + kMrptTicksAtUnixEpoch));
}

/// Exact.
inline std::int64_t nanosecondsFrom(const mrpt::Clock::time_point& time) {
  return (time.time_since_epoch().count() - kMrptTicksAtUnixEpoch) * kMrptTickNs;
}

}  // namespace efm
