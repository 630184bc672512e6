// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "plugin/streams/recording_parts.h"

namespace efm {

/// A unit of time as its exponent: 10^exponent seconds, 0, -3, -6 or -9.

/// "s", "ms", "us" or "ns", also as "sec", "µs" …; nothing for other words.
std::optional<int> timeExponentOf(std::string_view unit);

/// The times at the beginning of a file that does not name their unit.
struct TimeSample {
  int count = 0;
  bool whole = true;  ///< Without decimals.
  double max = 0;     ///< The largest absolute value.
};

/// The exponent of `--time-unit` if there is one, else the unit that the times can have: seconds
/// where they have decimals (or are fewer than ten), nanoseconds where they are too large for
/// another unit.
/// @param where for the error.
/// @throws std::runtime_error naming the option, where the unit cannot be told.
int timeExponent(const ReaderOptions& options, const TimeSample& sample, const std::string& where);

/// What a word of a header names, and the unit in its brackets or after its last underscore:
/// "#timestamp [ns]" is timestamp and ns, "t_us" is t and us. In lower case.
struct HeaderWord {
  std::string name;
  std::optional<int> time_exponent;  ///< Of a time.

  bool isTime() const;
};
HeaderWord headerWord(std::string_view text);

}  // namespace efm
