// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>
#include <string_view>
#include <type_traits>

#include "mapping/base/text.h"
#include "mapping/geometry/timestamp.h"
#include "plugin/recordings/calibration/calibration_file.h"

namespace efm {

inline constexpr std::int64_t kNanosecondsPerMicrosecond = 1'000;

/// The size that "640x480" says; nothing for other texts.
inline std::optional<CameraSize> cameraSizeOf(std::string_view text) {
  const std::size_t cross = text.find('x');
  if (cross == std::string_view::npos) return std::nullopt;
  const auto width = parseNumber<std::uint16_t>(text.substr(0, cross));
  const auto height = parseNumber<std::uint16_t>(text.substr(cross + 1));
  if (!width || !height || *width == 0 || *height == 0) return std::nullopt;
  return CameraSize{*width, *height};
}

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

/// How far apart the numbers of a real type are at a number.
template <typename Number>
double stepAt(Number number) {
  const Number size = std::abs(number);
  return static_cast<double>(std::nextafter(size, std::numeric_limits<Number>::infinity()) - size);
}

/// Times that are farther apart are no times of events or poses: float32 seconds from 16,384 s on.
inline constexpr double kMaxTimeStepNs = 1e6;
inline constexpr const char* kExpectedTime =
    "a time before the year 2116, and no float32 number that is over 1 ms from the next one";

/// A time of a file in nanoseconds; nothing beyond `kEndOfTimeNs`, and where the numbers of its
/// type are over `kMaxTimeStepNs` apart. A real number is rounded to the finest of 1, 10, 100 and
/// 1000 ns that its type resolves there. So decimals that were written come back, and none is
/// invented. A double resolves seconds to 1 ns up to 97 days, and today's Unix time to 240 ns.
/// @param unit_ns of the number: a power of ten.
template <typename Number>
std::optional<std::int64_t> nanoseconds(Number time, std::int64_t unit_ns) {
  if constexpr (std::is_floating_point_v<Number>) {
    const double step_ns = stepAt(time) * static_cast<double>(unit_ns);
    if (step_ns > kMaxTimeStepNs) return std::nullopt;
    std::int64_t grid_ns = 1;
    while (grid_ns < kNanosecondsPerMicrosecond && static_cast<double>(grid_ns) < step_ns) {
      grid_ns *= 10;
    }
    const auto value = static_cast<double>(time);
    const double rounded =
        std::round(unit_ns >= grid_ns ? value * static_cast<double>(unit_ns / grid_ns)
                                      : value / static_cast<double>(grid_ns / unit_ns));
    const std::int64_t end = kEndOfTimeNs / grid_ns;
    const auto whole = wholeNumber(rounded, -end, end);
    if (!whole) return std::nullopt;
    return *whole * grid_ns;
  } else {
    const std::int64_t end = kEndOfTimeNs / unit_ns;
    const auto whole = wholeNumber(time, -end, end);
    if (!whole) return std::nullopt;
    return *whole * unit_ns;
  }
}

}  // namespace efm
