// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "plugin/streams/recording_parts.h"

namespace efm {

/// Where the numbers of an event stand in a line of text.
struct EventColumns {
  std::string order = "txyp";      ///< A letter per column; '-' for one to ignore.
  char separator = ' ';            ///< ',' or ';'; blanks separate, too.
  int time_exponent = 0;           ///< Times count 10^time_exponent seconds.
  std::uint64_t header_lines = 0;  ///< To skip at the beginning of the file.
  std::optional<CameraSize> size;  ///< From a first line `width height`.
  std::vector<Warning> warnings;   ///< Where the values alone say order or unit.

  /// t x y p in seconds, between blanks.
  bool isUsual() const { return order == "txyp" && separator == ' ' && time_exponent == 0; }
};

/// Finds the columns from the beginning of a file. A first line with names (t or time …, x or col
/// …, y or row …, p or pol …, also behind a `#`) gives order and unit, one with two whole numbers
/// the sensor's size; options come before both. Without them: t x y p, or the order that the values
/// show (`orderOfValues`), with a warning.
/// @param beginning whole lines.
/// @param file for errors.
/// @throws std::runtime_error where `--event-columns` is wrong, also by the values; where the order is likely but not
/// certain; where the unit of time is not certain (`findTimeUnit`).
EventColumns findEventColumns(std::string_view beginning, const ReaderOptions& options,
                              const std::string& file);

/// Whether the beginning of a file is text whose first line with numbers has at least four, and not
/// the eight of a pose.
bool looksLikeEventLines(std::string_view beginning);

/// The fields of a line, between separators and blanks.
std::vector<std::string_view> eventFields(std::string_view line, char separator);

}  // namespace efm
