// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <type_traits>

#include "mapping/base/text.h"
#include "mapping/geometry/timestamp.h"
#include "plugin/recordings/calibration/calibration_file.h"
#include "plugin/recordings/streams/recording_parts.h"

namespace efm {

inline constexpr std::int64_t kNanosecondsPerMicrosecond = 1'000;

/// Returns the size in two texts; std::nullopt unless both are whole numbers from 1 to 65535.
inline std::optional<CameraSize> cameraSizeOf(std::string_view width_text,
                                              std::string_view height_text) {
  const auto width = parseNumber<std::uint16_t>(width_text);
  const auto height = parseNumber<std::uint16_t>(height_text);
  if (!width || !height || *width == 0 || *height == 0) return std::nullopt;
  return CameraSize{*width, *height};
}
/// Returns the size in a text like "640x480".
inline std::optional<CameraSize> cameraSizeOf(std::string_view text) {
  const std::size_t cross = text.find('x');
  if (cross == std::string_view::npos) return std::nullopt;
  return cameraSizeOf(text.substr(0, cross), text.substr(cross + 1));
}

/// Returns a number as a whole number; std::nullopt if it is not a whole number within [min, max].
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

/// Returns the distance to the next number of the floating-point type, away from zero.
template <typename Number>
double stepAt(Number number) {
  const Number size = std::abs(number);
  return static_cast<double>(std::nextafter(size, std::numeric_limits<Number>::infinity()) - size);
}

/// The largest `stepAt` of times of events or poses: float32 seconds from 16,384 s on exceed it.
inline constexpr double kMaxTimeStepNs = 1e6;
inline constexpr const char* kExpectedTime =
    "a time before the year 2116, and no float32 number that is over 1 ms from the next one";

/// Returns a time of a file in nanoseconds; std::nullopt if it is beyond `kEndOfTimeNs`, or its
/// `stepAt` is over `kMaxTimeStepNs`. A floating-point number is rounded to the finest of 1, 10,
/// 100 and 1000 ns that its type resolves there. So written decimals come back, and none are
/// invented. A double resolves seconds to 1 ns up to 97 days, and today's Unix time to 240 ns.
/// @param unit_ns unit of the number in ns: a power of ten.
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

/// Units of time are exponents: the unit is 10^exponent seconds, with 0, -3, -6 or -9.

/// Returns the exponent of "s", "ms", "us", "ns", "sec", "µs", "microseconds" …, else std::nullopt.
std::optional<int> timeExponentOf(std::string_view unit);

/// Returns the name of a unit: "us" for exponent -6.
std::string timeUnitOf(int exponent);

/// Returns the nanoseconds in a unit: 1000 for exponent -6.
std::int64_t nanosecondsPer(int exponent);

/// Statistics of the first times in a file that does not name their unit.
struct TimeSample {
  int count = 0;
  bool whole = true;    ///< True if no time has decimals.
  bool float32 = true;  ///< True if a float32 holds each time exactly.
  double max = 0;       ///< The largest absolute value.
  double earliest = 0;  ///< The smallest time.
  double latest = 0;
  bool rising = true;      ///< True if each time is later than the one before it.
  bool has_parts = false;  ///< True if a time is no whole number, however it is written.
  double last = 0;

  void add(double t, bool is_whole);
  /// Adds a time as it was written. With an exponent, as NumPy writes it, the value tells whether
  /// it is whole: 1.200012e+06.
  void add(double t, std::string_view text) {
    const bool exponent = text.find_first_of("eE") != std::string_view::npos;
    add(t, exponent ? std::floor(t) == t : text.find('.') == std::string_view::npos);
  }
  /// Adds a time. A number that is not finite is ignored.
  void add(double t);
};

/// The usual number of events or poses per second, to guess a unit.
struct UsualRate {
  const char* things;
  double min;
  double max;
  const char* option;
};
inline constexpr UsualRate kUsualEventRate = {"events", 1e3, 3e7, "--time-unit"};
inline UsualRate usualPoseRate(const ReaderOptions& options) {
  return {"poses", 5, 2000, options.pose_unit_option.c_str()};
}

struct TimeUnit {
  int exponent = 0;
  std::optional<Warning> warning;  ///< Set if only the values show the unit.
};

/// Returns the unit of `--time-unit` if it is given, else the unit of the times:
///   nanoseconds   if the times are too large for another unit;
///   seconds       if the times have decimals, or there are fewer than ten;
///   any unit      with times of the years 2000 to 2050 and a usual rate: with a warning.
/// @param where name of the file, for errors.
/// @throws std::runtime_error naming the option and the likely unit if the unit is not certain: for
/// other whole numbers, for decimals that are far too rare for seconds, and for times from float32
/// numbers that are over 1 ms apart.
TimeUnit findTimeUnit(const ReaderOptions& options, const TimeSample& sample,
                      const UsualRate& usual, const std::string& where);

/// @throws std::runtime_error naming the likely unit if poses with decimals are too rare for
/// seconds.
void requireSecondsOfPoses(const TimeSample& sample, const std::string& where,
                           const ReaderOptions& options);

/// Rejects times of poses that are no times, if no unit is given: one time for all poses, as six
/// written digits of a date give, and the numbers of frames.
/// @param renumber command that replaces numbers by times; empty: none.
void requireTimesOfPoses(const TimeSample& sample, const std::string& where,
                         const ReaderOptions& options, const std::string& renumber = {});

/// Finds the exponent for times of poses. Their option is `pose_time_unit`; `time_unit` holds for
/// whole numbers. A unit that only the values show is an error, too.
int poseTimeExponent(const ReaderOptions& options, const TimeSample& sample,
                     const std::string& where);

}  // namespace efm
