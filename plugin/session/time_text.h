// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "mapping/events/window.h"

namespace efm {

/// A time for the user, exact, and its distance from the recording's start:
/// "1468939802.345678901 s (+3.2 s)". The distance is rounded to milliseconds.
/// @param start_ns the recording's first event; nothing: the time alone.
std::string timeText(std::int64_t t_ns, std::optional<std::int64_t> start_ns);

/// The same of an interval: "10.100000000 to 10.300000000 s (+0.1 to +0.3 s)".
std::string timeText(std::int64_t first_ns, std::int64_t last_ns,
                     std::optional<std::int64_t> start_ns);

/// Time limits as options: "from --t0 2.000000000 s until --t1 3.000000000 s".
std::string limitsText(const TimeLimits& limits);

/// A duration: "42 s", "3:05 min" or, from an hour on, "01:23 h" (HH:MM).
std::string durationText(double seconds);

}  // namespace efm
