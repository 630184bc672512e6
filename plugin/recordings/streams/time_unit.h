// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "mapping/base/text.h"
#include "plugin/recordings/streams/recording_parts.h"

namespace efm {

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
