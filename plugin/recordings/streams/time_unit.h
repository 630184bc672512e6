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

/// The size that two texts say; nothing if they are no whole numbers from 1 to 65535.
inline std::optional<CameraSize> cameraSizeOf(std::string_view width_text,
                                              std::string_view height_text) {
  const auto width = parseNumber<std::uint16_t>(width_text);
  const auto height = parseNumber<std::uint16_t>(height_text);
  if (!width || !height || *width == 0 || *height == 0) return std::nullopt;
  return CameraSize{*width, *height};
}
/// The size that "640x480" says.
inline std::optional<CameraSize> cameraSizeOf(std::string_view text) {
  const std::size_t cross = text.find('x');
  if (cross == std::string_view::npos) return std::nullopt;
  return cameraSizeOf(text.substr(0, cross), text.substr(cross + 1));
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

/// A unit of time as its exponent: 10^exponent seconds, 0, -3, -6 or -9.

/// "s", "ms", "us" or "ns", also as "sec", "µs", "microseconds" …; nothing for other words.
std::optional<int> timeExponentOf(std::string_view unit);

/// The name of a unit: "us" for -6.
std::string timeUnitOf(int exponent);

/// Nanoseconds in a unit: 1000 for -6.
std::int64_t nanosecondsPer(int exponent);

/// Metres in a unit of length: 0.001 for "mm"; nothing for other words than m, cm and mm.
std::optional<double> metresOf(std::string_view unit);

/// The times at the beginning of a file that does not name their unit.
struct TimeSample {
  int count = 0;
  bool whole = true;    ///< Without decimals.
  bool float32 = true;  ///< All are numbers that a float32 holds.
  double max = 0;       ///< The largest absolute value.
  double earliest = 0;  ///< Of the times.
  double latest = 0;

  void add(double t, bool is_whole);
  /// A number that is not finite is left out.
  void add(double t);
};

/// How many things of a kind come in a second, usually: for the guess of a unit.
struct UsualRate {
  const char* things;
  double min;
  double max;
};
inline constexpr UsualRate kUsualEventRate = {"events", 1e3, 3e7};
inline constexpr UsualRate kUsualPoseRate = {"poses", 5, 2000};

/// A unit of time, and how it was found.
struct TimeUnit {
  int exponent = 0;
  std::optional<Warning> warning;  ///< Where the values alone say it.
};

/// The unit of `--time-unit` if there is one, else the one that the times have:
///   nanoseconds   where they are too large for another unit;
///   seconds       where they have decimals (or are fewer than ten);
///   a unit in which they are of the years 2000 to 2050, and their rate is usual: with a warning.
/// @param where for errors.
/// @throws std::runtime_error naming the option and the likely unit, where it is not certain: other
/// whole numbers, decimals that are far too rare for seconds, and times that were float32 and are
/// over 1 ms apart.
TimeUnit findTimeUnit(const ReaderOptions& options, const TimeSample& sample,
                      const UsualRate& usual, const std::string& where);

/// The same for poses, as an exponent. A unit that their values alone say is an error, too.
int poseTimeExponent(const ReaderOptions& options, const TimeSample& sample,
                     const std::string& where);

/// What a word of a header names, and the unit in its brackets or after its last underscore:
/// "#timestamp [ns]" is timestamp and ns, "t_us" is t and us, "microseconds" is t and us, "x_mm" is
/// x and mm. In lower case.
struct HeaderWord {
  std::string name;
  std::string unit;                  ///< Empty where there is none.
  std::optional<int> time_exponent;  ///< Of a time.

  bool isTime() const;
};
HeaderWord headerWord(std::string_view text);

}  // namespace efm
